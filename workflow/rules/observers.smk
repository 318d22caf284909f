"""Observers: models of other targets, trained on squares that hold the target, of the surveys with the roles ``train``
and ``observe``.

They have the stages of the models of towers, on crops of their own, and are trained from one seed.
"""


rule squares:
    input:
        survey=lambda w: source(w.survey),
        truth=lambda w: truth_of(w.survey),
    output:
        store=f"{R}/squares/{{observer}}/{{survey}}/crops.zarr.zip",
        manifest=f"{R}/squares/{{observer}}/{{survey}}/manifest.json",
        provenance=f"{R}/squares/{{observer}}/{{survey}}/provenance.json",
    log:
        f"{R}/logs/squares/{{observer}}-{{survey}}.log",
    benchmark:
        f"{R}/benchmarks/squares/{{observer}}-{{survey}}.tsv"
    wildcard_constraints:
        survey=any_of(OBSERVE),
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=120,
    params:
        job=lambda w: job(
            "squares",
            OBSERVED[w.observer].square.model_dump(mode="json"),
            survey=w.survey,
            codes=SURVEYS[w.survey].codes,
            target=finds(w),
            input=source_prints(w.survey),
        ),
    message:
        "Cutting {wildcards.survey} into squares for {wildcards.observer}"
    script:
        "../scripts/squares.py"


rule square_voxels:
    input:
        store=f"{R}/squares/{{observer}}/{{survey}}/crops.zarr.zip",
        manifest=f"{R}/squares/{{observer}}/{{survey}}/manifest.json",
    output:
        store=f"{R}/square_voxels/{{observer}}/{{survey}}/voxels.zarr.zip",
        manifest=f"{R}/square_voxels/{{observer}}/{{survey}}/manifest.json",
        provenance=f"{R}/square_voxels/{{observer}}/{{survey}}/provenance.json",
    log:
        f"{R}/logs/square_voxels/{{observer}}-{{survey}}.log",
    benchmark:
        f"{R}/benchmarks/square_voxels/{{observer}}-{{survey}}.tsv"
    wildcard_constraints:
        survey=any_of(OBSERVE),
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=60,
    params:
        job=lambda w: job("voxels", grid_of(w), shapes=False),
    message:
        "Voxelising the squares of {wildcards.survey} for {wildcards.observer}"
    script:
        "../scripts/voxels.py"


rule square_split:
    input:
        manifests=squares_of("manifest"),
    output:
        split=f"{R}/square_split/{{observer}}/split.csv",
        provenance=f"{R}/square_split/{{observer}}/provenance.json",
    log:
        f"{R}/logs/square_split/{{observer}}.log",
    benchmark:
        f"{R}/benchmarks/square_split/{{observer}}.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        job=lambda w: job(
            "square_split",
            split_of(w.observer),
            seed=split_of(w.observer)["seed"],
            observer=w.observer,
            target=finds(w),
        ),
    message:
        "Splitting the squares for {wildcards.observer} into training, validation and test"
    script:
        "../scripts/square_split.py"


rule train_observer:
    input:
        stores=square_voxels_of("store"),
        manifests=square_voxels_of("manifest"),
        split=f"{R}/square_split/{{observer}}/split.csv",
    output:
        model=f"{R}/train/{{observer}}/seed-{SEED}/model.json",
        history=f"{R}/train/{{observer}}/seed-{SEED}/history.csv",
        resources=f"{R}/train/{{observer}}/seed-{SEED}/resources.json",
        provenance=f"{R}/train/{{observer}}/seed-{SEED}/provenance.json",
    log:
        f"{R}/logs/train_observer/{{observer}}.log",
    benchmark:
        f"{R}/benchmarks/train_observer/{{observer}}.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=600,
    params:
        job=lambda w: job(
            "train",
            OBSERVED[w.observer].model().model_dump(mode="json"),
            seed=SEED,
            grid=grid_of(w),
        ),
    message:
        "Training the observer {wildcards.observer}"
    script:
        "../scripts/train.py"


rule tune_observer:
    input:
        model=f"{R}/train/{{observer}}/seed-{SEED}/model.json",
        stores=square_voxels_of("store"),
        manifests=square_voxels_of("manifest"),
        crop_stores=squares_of("store"),
        crops=squares_of("manifest"),
        split=f"{R}/square_split/{{observer}}/split.csv",
    output:
        model=in_report(
            f"{R}/models/{{observer}}.json",
            "model",
            "models",
            "Files",
            {"model": "{observer}"},
        ),
        tuning=f"{R}/tune/{{observer}}/seed-{SEED}.json",
        provenance=f"{R}/tune/{{observer}}/seed-{SEED}.provenance.json",
    log:
        f"{R}/logs/tune_observer/{{observer}}.log",
    benchmark:
        f"{R}/benchmarks/tune_observer/{{observer}}.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=60,
    params:
        job=job("tune", {"tuning": {}, "detection": None}),
    message:
        "Choosing the threshold of {wildcards.observer}"
    script:
        "../scripts/tune.py"


rule evaluate_observer:
    input:
        model=f"{R}/models/{{observer}}.json",
        stores=square_voxels_of("store"),
        manifests=square_voxels_of("manifest"),
        crop_stores=squares_of("store"),
        crops=squares_of("manifest"),
        split=f"{R}/square_split/{{observer}}/split.csv",
    output:
        scores=f"{R}/evaluate/{{observer}}/seed-{SEED}.json",
        provenance=f"{R}/evaluate/{{observer}}/seed-{SEED}.provenance.json",
    log:
        f"{R}/logs/evaluate_observer/{{observer}}.log",
    benchmark:
        f"{R}/benchmarks/evaluate_observer/{{observer}}.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=120,
    params:
        job=job("evaluate", {}, part="test"),
    message:
        "Scoring the observer {wildcards.observer} on the test squares"
    script:
        "../scripts/evaluate.py"


if settings.boosted_trees:

    rule observer_trees:
        input:
            stores=square_voxels_of("store"),
            manifests=square_voxels_of("manifest"),
            crop_stores=squares_of("store"),
            crops=squares_of("manifest"),
            split=f"{R}/square_split/{{observer}}/split.csv",
        output:
            scores=f"{R}/boosted_trees/{{observer}}/seed-{SEED}.json",
            provenance=f"{R}/boosted_trees/{{observer}}/seed-{SEED}.provenance.json",
        log:
            f"{R}/logs/observer_trees/{{observer}}.log",
        benchmark:
            f"{R}/benchmarks/observer_trees/{{observer}}.tsv"
        conda:
            "../envs/scenenet.yaml"
        threads: 1
        resources:
            mem_mb=3000,
            runtime=120,
        params:
            job=lambda w: job(
                "observer_trees",
                {"false_weight": OBSERVED[w.observer].model().metric.false_weight},
                seed=SEED,
                observer=w.observer,
                target=finds(w),
            ),
        message:
            "Training and scoring the boosted trees beside {wildcards.observer} (baseline)"
        script:
            "../scripts/observer_trees.py"
