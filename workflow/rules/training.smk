"""Training: the model of each seed, its threshold, and the best seed (thesis 4.3 to 4.5, 5.2).

A SCENE-Net is a JSON file, and a CNN is a safetensors file. Snakemake has to know the names of outputs
beforehand, so each stage that writes models has a rule for either kind.
"""

for kind, suffix in MODEL_SUFFIXES.items():

    rule:
        name:
            f"train_{kind}"
        input:
            stores=every("voxels", "store"),
            manifests=every("voxels", "manifest"),
            split=f"{R}/split/split.csv",
        output:
            model=f"{R}/train/{{model}}/seed-{{seed}}/model{suffix}",
            history=f"{R}/train/{{model}}/seed-{{seed}}/history.csv",
            resources=f"{R}/train/{{model}}/seed-{{seed}}/resources.json",
            provenance=f"{R}/train/{{model}}/seed-{{seed}}/provenance.json",
        log:
            f"{R}/logs/train/{{model}}-seed-{{seed}}.log",
        benchmark:
            f"{R}/benchmarks/train/{{model}}-seed-{{seed}}.tsv"
        wildcard_constraints:
            model=any_of(models_of(kind)),
        conda:
            "../envs/scenenet.yaml"
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

    rule:
        name:
            f"tune_{kind}"
        input:
            model=f"{R}/train/{{model}}/seed-{{seed}}/model{suffix}",
            stores=every("voxels", "store"),
            manifests=every("voxels", "manifest"),
            crop_stores=every("crops", "store"),
            crops=every("crops", "manifest"),
            split=f"{R}/split/split.csv",
        output:
            model=f"{R}/models/{{model}}/seed-{{seed}}{suffix}",
            tuning=f"{R}/tune/{{model}}/seed-{{seed}}.json",
            provenance=f"{R}/tune/{{model}}/seed-{{seed}}.provenance.json",
        log:
            f"{R}/logs/tune/{{model}}-seed-{{seed}}.log",
        benchmark:
            f"{R}/benchmarks/tune/{{model}}-seed-{{seed}}.tsv"
        wildcard_constraints:
            model=any_of(models_of(kind)),
        conda:
            "../envs/scenenet.yaml"
        threads: 1
        resources:
            mem_mb=3000,
            runtime=60,
        params:
            job=lambda w: job("tune", tuning_of(w.model)),
        message:
            "Choosing the threshold of {wildcards.model}, seed {wildcards.seed}"
        script:
            "../scripts/tune.py"

    rule:
        name:
            f"champion_{kind}"
        input:
            models=expand(
                f"{R}/models/{{model}}/seed-{{seed}}{suffix}",
                seed=VALUES["seed"],
                allow_missing=True,
            ),
            tunings=expand(
                f"{R}/tune/{{model}}/seed-{{seed}}.json",
                seed=VALUES["seed"],
                allow_missing=True,
            ),
        output:
            model=in_report(
                f"{R}/models/{{model}}{suffix}",
                "model",
                "models",
                "Files",
                {"model": "{model}"},
            ),
            provenance=f"{R}/models/{{model}}.provenance.json",
        log:
            f"{R}/logs/champion/{{model}}.log",
        benchmark:
            f"{R}/benchmarks/champion/{{model}}.tsv"
        wildcard_constraints:
            model=any_of(models_of(kind)),
        conda:
            "../envs/scenenet.yaml"
        threads: 1
        resources:
            mem_mb=1000,
            runtime=10,
        params:
            job=job("champion", {}),
        message:
            "Choosing the seed of {wildcards.model} that is best on validation"
        script:
            "../scripts/champion.py"
