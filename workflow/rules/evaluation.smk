"""Evaluation: scores, times and verified properties of the models, and the baseline (thesis 5.2)."""


rule evaluate:
    input:
        model=lambda w: tuned_file(w.model, w.seed),
        stores=every("voxels", "store"),
        manifests=every("voxels", "manifest"),
        crop_stores=every("crops", "store") if settings.score_towers else [],
        crops=every("crops", "manifest") if settings.score_towers else [],
        split=f"{R}/split/split.csv",
    output:
        scores=f"{R}/evaluate/{{model}}/seed-{{seed}}.json",
        provenance=f"{R}/evaluate/{{model}}/seed-{{seed}}.provenance.json",
    log:
        f"{R}/logs/evaluate/{{model}}-seed-{{seed}}.log",
    benchmark:
        f"{R}/benchmarks/evaluate/{{model}}-seed-{{seed}}.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=120,
    params:
        job=job("evaluate", SETTINGS["detection"], part="test"),
    message:
        "Scoring {wildcards.model}, seed {wildcards.seed}, on the test crops"
    script:
        "../scripts/evaluate.py"


rule certificate:
    input:
        model=lambda w: champion_file(w.model),
    output:
        certificate=f"{R}/certificate/{{model}}.json",
        provenance=f"{R}/certificate/{{model}}.provenance.json",
    log:
        f"{R}/logs/certificate/{{model}}.log",
    benchmark:
        f"{R}/benchmarks/certificate/{{model}}.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=20,
    params:
        job=job("certificate", {}),
    message:
        "Verifying the properties of a GENEO for {wildcards.model}"
    script:
        "../scripts/certificate.py"


rule inference_time:
    input:
        model=lambda w: champion_file(w.model),
        stores=every("crops", "store"),
        manifests=every("crops", "manifest"),
        split=f"{R}/split/split.csv",
    output:
        times=f"{R}/inference_time/{{model}}.json",
        provenance=f"{R}/inference_time/{{model}}.provenance.json",
    log:
        f"{R}/logs/inference_time/{{model}}.log",
    benchmark:
        f"{R}/benchmarks/inference_time/{{model}}.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=30,
    params:
        job=job("inference_time", {}),
    message:
        "Timing {wildcards.model} on test crops"
    script:
        "../scripts/inference_time.py"


if settings.boosted_trees:

    rule boosted_trees:
        input:
            stores=every("voxels", "store"),
            manifests=every("voxels", "manifest"),
            crop_stores=every("crops", "store") if settings.score_towers else [],
            crops=every("crops", "manifest") if settings.score_towers else [],
            split=f"{R}/split/split.csv",
        output:
            scores=expand(f"{R}/boosted_trees/seed-{{seed}}.json", seed=VALUES["seed"]),
            times=f"{R}/boosted_trees/times.json",
            provenance=f"{R}/boosted_trees/provenance.json",
        log:
            f"{R}/logs/boosted_trees.log",
        benchmark:
            f"{R}/benchmarks/boosted_trees.tsv"
        conda:
            "../envs/scenenet.yaml"
        threads: 1
        resources:
            mem_mb=3000,
            runtime=120,
        params:
            job=job("boosted_trees", SETTINGS["detection"], seeds=list(settings.seeds)),
        message:
            "Training and scoring the boosted trees (baseline)"
        script:
            "../scripts/boosted_trees.py"
