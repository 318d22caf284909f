"""Contests: SCENE-Net and its rivals on the same crops (thesis 5.2.4, 5.2.5)."""

NOISE_SEEDS = settings.noise.seeds if "noise" in CONTESTS else []


rule noise:
    output:
        runs=f"{R}/noise/seed-{{seed}}.csv",
        provenance=f"{R}/noise/seed-{{seed}}.provenance.json",
    log:
        f"{R}/logs/noise/seed-{{seed}}.log",
    benchmark:
        f"{R}/benchmarks/noise/seed-{{seed}}.tsv"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=600,
    params:
        job=lambda w: job(
            "noise",
            {name: value for name, value in SETTINGS["noise"].items() if name != "seeds"},
            models=[model.model_dump(mode="json") for model in settings.noise_models()],
            voxels=SETTINGS["voxels"],
            seed=int(w.seed),
        ),
    message:
        "Training on wrong labels, seed {wildcards.seed}"
    script:
        "../scripts/noise.py"


rule noise_runs:
    input:
        runs=expand(f"{R}/noise/seed-{{seed}}.csv", seed=NOISE_SEEDS),
    output:
        runs=shown(
            f"{R}/noise/runs.csv",
            "noise-runs",
            "studies",
            "Trainings",
            {"table": "Trained on wrong labels, each training"},
        ),
        provenance=f"{R}/noise/provenance.json",
    log:
        f"{R}/logs/noise/runs.log",
    benchmark:
        f"{R}/benchmarks/noise/runs.tsv"
    threads: 1
    resources:
        mem_mb=500,
        runtime=5,
    params:
        job=job("contest_runs", {}),
    message:
        "Putting the trainings on wrong labels together"
    script:
        "../scripts/contest_runs.py"


rule contest_figure:
    input:
        runs=f"{R}/{{contest}}/runs.csv",
    output:
        pictures=[
            shown(
                f"{R}/figures/{{contest}}.png",
                "figure-contest",
                "studies",
                "Figures",
                lambda w: {"figure": TABLE_TITLES[w.contest][0]},
            )
        ],
        captions=[f"{R}/figures/{{contest}}.json"],
        provenance=f"{R}/figures/{{contest}}.provenance.json",
    log:
        f"{R}/logs/contest_figure/{{contest}}.log",
    benchmark:
        f"{R}/benchmarks/contest_figure/{{contest}}.tsv"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        job=lambda w: job(
            "figures",
            {},
            results=gathered(models=[], surveys=[], contests=[w.contest]),
            pictures=[w.contest],
            sources={},
        ),
    message:
        "Drawing the contest {wildcards.contest}"
    script:
        "../scripts/figures.py"


rule track_contest:
    input:
        store=f"{R}/mlflow/store.json",
        runs=f"{R}/{{contest}}/runs.csv",
    output:
        runs=f"{R}/mlflow/{{contest}}.json",
        provenance=f"{R}/mlflow/{{contest}}.provenance.json",
    log:
        f"{R}/logs/track_contest/{{contest}}.log",
    benchmark:
        f"{R}/benchmarks/track_contest/{{contest}}.tsv"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=30,
    params:
        job=lambda w: job(
            "track_contest",
            SETTINGS["tracking"],
            dataset=settings.dataset,
            contest=w.contest,
        ),
    message:
        "Logging the contest {wildcards.contest} to MLflow"
    script:
        "../scripts/track_contest.py"
