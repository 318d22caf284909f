"""Contests: SCENE-Net and its rivals on the same crops (thesis 5.2.4, 5.2.5)."""

# No model can be called so: its name has no dot.
BLACK_BOX_RIVAL = "black.box"
CROSSED = {
    **{model.name: model.model_dump(mode="json") for model in settings.crossed_models()},
    BLACK_BOX_RIVAL: None,
}
NOISE_SEEDS = settings.noise.seeds if "noise" in CONTESTS else []


# Of the jobs of a contest, all of the same settings and code, one speaks for the others.
FIRST_RECORD = {
    "cross_validation": f"{R}/cross_validation/{next(iter(CROSSED))}/provenance.json",
    "noise": f"{R}/noise/seed-{next(iter(NOISE_SEEDS), 0)}.provenance.json",
}


rule cross_validate:
    input:
        stores=VOXEL_STORES,
        manifests=VOXEL_MANIFESTS,
    output:
        runs=f"{R}/cross_validation/{{rival}}/runs.csv",
        provenance=f"{R}/cross_validation/{{rival}}/provenance.json",
    log:
        f"{R}/logs/cross_validation/{{rival}}.log",
    benchmark:
        f"{R}/benchmarks/cross_validation/{{rival}}.tsv"
    wildcard_constraints:
        rival=any_of(CROSSED),
    threads: 1
    resources:
        mem_mb=3000,
        runtime=600,
    params:
        job=lambda w: job(
            "cross_validate",
            {
                "leave_out": settings.cross_validation.leave_out,
                "neighbour": settings.split.neighbour,
                "detection": SETTINGS["detection"],
            },
            model=CROSSED[w.rival],
            seeds=list(settings.seeds),
        ),
    message:
        "Cross-validating {wildcards.rival}"
    script:
        "../scripts/cross_validate.py"


rule cross_validation_runs:
    input:
        runs=expand(f"{R}/cross_validation/{{rival}}/runs.csv", rival=CROSSED),
    output:
        runs=shown(
            f"{R}/cross_validation/runs.csv",
            "cross_validation-runs",
            "models",
            "Trainings",
            {"table": "Every crop a test crop once, each training"},
        ),
        provenance=f"{R}/cross_validation/provenance.json",
    log:
        f"{R}/logs/cross_validation/runs.log",
    benchmark:
        f"{R}/benchmarks/cross_validation/runs.tsv"
    threads: 1
    resources:
        mem_mb=500,
        runtime=5,
    params:
        job=job("contest_runs", {}),
    message:
        "Putting the folds of all models together"
    script:
        "../scripts/contest_runs.py"


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
        gathered=f"{R}/{{contest}}/provenance.json",
        record=lambda w: FIRST_RECORD[w.contest],
        pictures=f"{R}/figures/{{contest}}.png",
        captions=f"{R}/figures/{{contest}}.json",
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
