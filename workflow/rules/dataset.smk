"""The dataset: towers, their surroundings, grids, and the parts (thesis 5.1)."""


rule towers:
    input:
        survey=lambda w: source(w.survey),
    output:
        towers=f"{R}/towers/{{survey}}/towers.csv",
        provenance=f"{R}/towers/{{survey}}/provenance.json",
    log:
        f"{R}/logs/towers/{{survey}}.log",
    benchmark:
        f"{R}/benchmarks/towers/{{survey}}.tsv"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=60,
    params:
        job=lambda w: job(
            "towers",
            SETTINGS["towers"],
            codes=SURVEYS[w.survey].codes,
            input={"survey": source_print(w.survey)},
        ),
    message:
        "Finding the labelled towers of {wildcards.survey}"
    script:
        "../scripts/towers.py"


rule crops:
    input:
        survey=lambda w: source(w.survey),
        towers=f"{R}/towers/{{survey}}/towers.csv",
    output:
        store=f"{R}/crops/{{survey}}/crops.zarr.zip",
        manifest=f"{R}/crops/{{survey}}/manifest.json",
        provenance=f"{R}/crops/{{survey}}/provenance.json",
    log:
        f"{R}/logs/crops/{{survey}}.log",
    benchmark:
        f"{R}/benchmarks/crops/{{survey}}.tsv"
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
            input={"survey": source_print(w.survey)},
        ),
    message:
        "Cutting out the surroundings of the towers of {wildcards.survey}"
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
    threads: 1
    resources:
        mem_mb=2000,
        runtime=60,
    params:
        job=lambda w: job("voxels", SETTINGS["voxels"]),
    message:
        "Laying grids over the crops of {wildcards.survey}"
    script:
        "../scripts/voxels.py"


rule split:
    input:
        manifests=CROP_MANIFESTS,
    output:
        split=f"{R}/split/split.csv",
        provenance=f"{R}/split/provenance.json",
    log:
        f"{R}/logs/split.log",
    benchmark:
        f"{R}/benchmarks/split.tsv"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        job=job("split", SETTINGS["split"], seed=SETTINGS["split"]["seed"]),
    message:
        "Sharing the crops out to training, validation and test"
    script:
        "../scripts/split.py"


rule grid_times:
    input:
        stores=CROP_STORES,
        manifests=CROP_MANIFESTS,
    output:
        times=f"{R}/times/grids.csv",
        provenance=f"{R}/times/grids.provenance.json",
    log:
        f"{R}/logs/grid_times.log",
    benchmark:
        f"{R}/benchmarks/grid_times.tsv"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=60,
    params:
        job=job("grid_times", {}),
    message:
        "Timing how crops become voxels"
    script:
        "../scripts/grid_times.py"
