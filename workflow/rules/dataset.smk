"""The dataset: towers, crops around them, voxel grids, and the split (thesis 5.1)."""


rule towers:
    input:
        survey=lambda w: source(w.survey),
        truth=lambda w: truth_of(w.survey),
    output:
        towers=f"{R}/towers/{{survey}}/towers.csv",
        true_towers=f"{R}/towers/{{survey}}/true_towers.csv",
        left_out=f"{R}/towers/{{survey}}/left_out.csv",
        provenance=f"{R}/towers/{{survey}}/provenance.json",
    log:
        f"{R}/logs/towers/{{survey}}.log",
    benchmark:
        f"{R}/benchmarks/towers/{{survey}}.tsv"
    wildcard_constraints:
        survey=any_of(TRAIN),
    priority: 2
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=60,
    params:
        job=lambda w: job(
            "towers",
            SETTINGS["towers"],
            codes=SURVEYS[w.survey].codes,
            input=source_prints(w.survey),
        ),
    message:
        "Finding the labelled towers of {wildcards.survey}"
    script:
        "../scripts/towers.py"


rule crops:
    input:
        survey=lambda w: source(w.survey),
        truth=lambda w: truth_of(w.survey),
        towers=f"{R}/towers/{{survey}}/towers.csv",
        true_towers=f"{R}/towers/{{survey}}/true_towers.csv",
        towers_record=f"{R}/towers/{{survey}}/provenance.json",
    output:
        store=f"{R}/crops/{{survey}}/crops.zarr.zip",
        manifest=f"{R}/crops/{{survey}}/manifest.json",
        provenance=f"{R}/crops/{{survey}}/provenance.json",
    log:
        f"{R}/logs/crops/{{survey}}.log",
    benchmark:
        f"{R}/benchmarks/crops/{{survey}}.tsv"
    wildcard_constraints:
        survey=any_of(TRAIN),
    # Before new surveys are made: temporary ones, which are large, are deleted after it.
    priority: 3
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=120,
    params:
        job=lambda w: job(
            "crops",
            SETTINGS["crops"],
            survey=w.survey,
            codes=SURVEYS[w.survey].codes,
            input=source_prints(w.survey),
        ),
    message:
        "Cropping {wildcards.survey} around its towers"
    script:
        "../scripts/crops.py"


rule voxels:
    input:
        store=f"{R}/crops/{{survey}}/crops.zarr.zip",
        manifest=f"{R}/crops/{{survey}}/manifest.json",
    output:
        store=f"{R}/voxels/{{survey}}/{GRID}/voxels.zarr.zip",
        manifest=f"{R}/voxels/{{survey}}/{GRID}/manifest.json",
        provenance=f"{R}/voxels/{{survey}}/{GRID}/provenance.json",
    log:
        f"{R}/logs/voxels/{{survey}}-{GRID}.log",
    benchmark:
        f"{R}/benchmarks/voxels/{{survey}}-{GRID}.tsv"
    wildcard_constraints:
        survey=any_of(TRAIN),
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=60,
    params:
        job=job("voxels", SETTINGS["voxels"], shapes=settings.measure_shapes()),
    message:
        "Voxelising the crops of {wildcards.survey}"
    script:
        "../scripts/voxels.py"


rule split:
    input:
        manifests=every("crops", "manifest"),
    output:
        split=f"{R}/split/split.csv",
        provenance=f"{R}/split/provenance.json",
    log:
        f"{R}/logs/split.log",
    benchmark:
        f"{R}/benchmarks/split.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        job=job("split", SETTINGS["split"], seed=SETTINGS["split"]["seed"]),
    message:
        "Splitting the crops into training, validation and test"
    script:
        "../scripts/split.py"


rule voxelisation_time:
    input:
        stores=every("crops", "store"),
        manifests=every("crops", "manifest"),
    output:
        times=f"{R}/voxelisation_time/times.csv",
        provenance=f"{R}/voxelisation_time/provenance.json",
    log:
        f"{R}/logs/voxelisation_time.log",
    benchmark:
        f"{R}/benchmarks/voxelisation_time.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=60,
    params:
        job=job("voxelisation_time", {}),
    message:
        "Timing the voxelisation of the crops"
    script:
        "../scripts/voxelisation_time.py"


rule dataset_tables:
    input:
        checks=every("check", "classes", survey=TRAIN),
        towers=[*every("towers", "towers"), *every("towers", "true_towers")],
        crops=every("crops", "manifest"),
        thesis=ancient(own_file(settings.thesis)),
    output:
        tables=[table_in_report(f"{R}/tables/{name}.csv") for name in DATASET_TABLES],
        provenance=f"{R}/dataset/provenance.json",
    log:
        f"{R}/logs/dataset_tables.log",
    benchmark:
        f"{R}/benchmarks/dataset_tables.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        job=job("dataset_tables", {}, results=results_of(models=[]), input=THESIS),
    message:
        "Writing the statistics of the dataset"
    script:
        "../scripts/dataset_tables.py"
