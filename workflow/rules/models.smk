"""Models: training, threshold, best seed, scores (thesis 4.3 to 4.5, 5.2).

A SCENE-Net is a JSON file and a CNN has its weights in safetensors. Snakemake has to know the names
of outputs beforehand, so the rules that write models come in two forms that differ in nothing else.
"""


rule train:
    input:
        stores=VOXEL_STORES,
        manifests=VOXEL_MANIFESTS,
        split=f"{R}/split/split.csv",
    output:
        model=f"{R}/train/{{model}}/seed-{{seed}}/model.json",
        history=f"{R}/train/{{model}}/seed-{{seed}}/history.csv",
        resources=f"{R}/train/{{model}}/seed-{{seed}}/resources.json",
        provenance=f"{R}/train/{{model}}/seed-{{seed}}/provenance.json",
    log:
        f"{R}/logs/train/{{model}}-seed-{{seed}}.log",
    benchmark:
        f"{R}/benchmarks/train/{{model}}-seed-{{seed}}.tsv"
    wildcard_constraints:
        model=any_of(models_of("scenenet")),
    threads: 1
    resources:
        mem_mb=3000,
        runtime=600,
    params:
        job=lambda w: job(
            "train",
            model_settings(w.model),
            seed=int(w.seed),
            grid=SETTINGS["voxels"],
        ),
    message:
        "Training {wildcards.model} from seed {wildcards.seed}"
    script:
        "../scripts/train.py"


use rule train as train_cnn with:
    output:
        model=f"{R}/train/{{model}}/seed-{{seed}}/model.safetensors",
        history=f"{R}/train/{{model}}/seed-{{seed}}/history.csv",
        resources=f"{R}/train/{{model}}/seed-{{seed}}/resources.json",
        provenance=f"{R}/train/{{model}}/seed-{{seed}}/provenance.json",
    wildcard_constraints:
        model=any_of(models_of("cnn")),


rule tune:
    input:
        model=f"{R}/train/{{model}}/seed-{{seed}}/model.json",
        stores=VOXEL_STORES,
        manifests=VOXEL_MANIFESTS,
        split=f"{R}/split/split.csv",
    output:
        model=f"{R}/models/{{model}}/seed-{{seed}}.json",
        tuning=f"{R}/tune/{{model}}/seed-{{seed}}.json",
        provenance=f"{R}/tune/{{model}}/seed-{{seed}}.provenance.json",
    log:
        f"{R}/logs/tune/{{model}}-seed-{{seed}}.log",
    benchmark:
        f"{R}/benchmarks/tune/{{model}}-seed-{{seed}}.tsv"
    wildcard_constraints:
        model=any_of(models_of("scenenet")),
    threads: 1
    resources:
        mem_mb=3000,
        runtime=60,
    params:
        job=job("tune", SETTINGS["tuning"]),
    message:
        "Choosing the threshold of {wildcards.model} seed {wildcards.seed}"
    script:
        "../scripts/tune.py"


use rule tune as tune_cnn with:
    input:
        model=f"{R}/train/{{model}}/seed-{{seed}}/model.safetensors",
        stores=VOXEL_STORES,
        manifests=VOXEL_MANIFESTS,
        split=f"{R}/split/split.csv",
    output:
        model=f"{R}/models/{{model}}/seed-{{seed}}.safetensors",
        tuning=f"{R}/tune/{{model}}/seed-{{seed}}.json",
        provenance=f"{R}/tune/{{model}}/seed-{{seed}}.provenance.json",
    wildcard_constraints:
        model=any_of(models_of("cnn")),


rule champion:
    input:
        models=lambda w: [tuned_file(w.model, seed) for seed in settings.seeds],
        tunings=lambda w: [f"{R}/tune/{w.model}/seed-{seed}.json" for seed in settings.seeds],
    output:
        model=shown_model(f"{R}/models/{{model}}.json"),
        provenance=f"{R}/models/{{model}}.provenance.json",
    log:
        f"{R}/logs/champion/{{model}}.log",
    benchmark:
        f"{R}/benchmarks/champion/{{model}}.tsv"
    wildcard_constraints:
        model=any_of(models_of("scenenet")),
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        job=job("champion", {}),
    message:
        "Picking the seed of {wildcards.model} that is best on validation"
    script:
        "../scripts/champion.py"


use rule champion as champion_cnn with:
    output:
        model=shown_model(f"{R}/models/{{model}}.safetensors"),
        provenance=f"{R}/models/{{model}}.provenance.json",
    wildcard_constraints:
        model=any_of(models_of("cnn")),


rule certificate:
    input:
        model=lambda w: champion_file(w.model),
    output:
        certificate=f"{R}/certificates/{{model}}.json",
        provenance=f"{R}/certificates/{{model}}.provenance.json",
    log:
        f"{R}/logs/certificate/{{model}}.log",
    benchmark:
        f"{R}/benchmarks/certificate/{{model}}.tsv"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=20,
    params:
        job=job("certificate", {}),
    message:
        "Working out which promises of a GENEO {wildcards.model} keeps"
    script:
        "../scripts/certificate.py"


rule timing:
    input:
        model=lambda w: champion_file(w.model),
        stores=CROP_STORES,
        manifests=CROP_MANIFESTS,
        split=f"{R}/split/split.csv",
    output:
        times=f"{R}/times/{{model}}.json",
        provenance=f"{R}/times/{{model}}.provenance.json",
    log:
        f"{R}/logs/timing/{{model}}.log",
    benchmark:
        f"{R}/benchmarks/timing/{{model}}.tsv"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=30,
    params:
        job=job("timing", {}),
    message:
        "Timing {wildcards.model} on test crops"
    script:
        "../scripts/timing.py"


rule evaluate:
    input:
        model=lambda w: tuned_file(w.model, w.seed),
        stores=VOXEL_STORES,
        manifests=VOXEL_MANIFESTS,
        split=f"{R}/split/split.csv",
    output:
        scores=f"{R}/evaluate/{{model}}/seed-{{seed}}.json",
        provenance=f"{R}/evaluate/{{model}}/seed-{{seed}}.provenance.json",
    log:
        f"{R}/logs/evaluate/{{model}}-seed-{{seed}}.log",
    benchmark:
        f"{R}/benchmarks/evaluate/{{model}}-seed-{{seed}}.tsv"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=120,
    params:
        job=job("evaluate", SETTINGS["detection"], part="test"),
    message:
        "Scoring {wildcards.model} seed {wildcards.seed} on the test crops"
    script:
        "../scripts/evaluate.py"


rule black_box:
    input:
        stores=VOXEL_STORES,
        manifests=VOXEL_MANIFESTS,
        split=f"{R}/split/split.csv",
    output:
        scores=BOOSTED_TREES,
        times=BLACK_BOX_TIMES,
        provenance=f"{R}/black_box/provenance.json",
    log:
        f"{R}/logs/black_box.log",
    benchmark:
        f"{R}/benchmarks/black_box.tsv"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=120,
    params:
        job=job("black_box", SETTINGS["detection"], seeds=list(settings.seeds)),
    message:
        "Training and scoring the black box to compare with"
    script:
        "../scripts/black_box.py"
