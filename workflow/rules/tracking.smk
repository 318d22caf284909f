"""MLflow: the store, and a run for every training.

The database is not an output of a rule. It holds the runs of other data and of other people, and Snakemake
deletes, or restores, the outputs of a job that fails. The record of the store says which database it
belongs to; ``request_for`` compares the two, so a database that was deleted or replaced is made again.
"""

from scenenet.tracking.store import request_for


rule mlflow_store:
    output:
        store=f"{R}/mlflow/store.json",
    log:
        f"{R}/logs/mlflow_store.log",
    benchmark:
        f"{R}/benchmarks/mlflow_store.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        # Not a function of ``output``: Snakemake does not compare such parameters with those of the
        # last run.
        job=lambda w: job(
            "mlflow_store",
            SETTINGS["tracking"],
            studies=[*VALUES["study"], *EXPERIMENTS],
            request=request_for(settings.tracking.uri, rules.mlflow_store.rule.output.store),
        ),
    message:
        "Creating the MLflow store"
    script:
        "../scripts/mlflow_store.py"


rule track:
    input:
        **pictures(model_figures()),
        store=f"{R}/mlflow/store.json",
        trainings=every("train", "history"),
        records=every("train", "provenance"),
        tunings=every("tune", "tuning"),
        models=every("tune", "model"),
        scores=every("evaluate", "scores"),
        boosted_trees=of_boosted_trees("scores"),
        observers=[
            *every("train_observer", "history"),
            *every("train_observer", "provenance"),
            *every("tune_observer", "tuning"),
            *every("tune_observer", "model"),
            *every("evaluate_observer", "scores"),
            *of_boosted_trees("scores", "observer_trees"),
        ],
    output:
        runs=f"{R}/mlflow/runs.json",
        provenance=f"{R}/mlflow/provenance.json",
    log:
        f"{R}/logs/track.log",
    benchmark:
        f"{R}/benchmarks/track.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=30,
    params:
        job=job(
            "track",
            SETTINGS["tracking"],
            dataset=settings.dataset,
            protocol=protocol(),
            common_settings={
                model.name: {"voxels": SETTINGS["voxels"], "split": SETTINGS["split"]}
                for model in settings.models
            }
            | {
                observer.name: {
                    "voxels": observer.grid().model_dump(mode="json"),
                    "square": observer.square.model_dump(mode="json"),
                    "split": split_of(observer.name),
                }
                for observer in settings.observers
            },
            results=results_of(observers=VALUES["observer"]),
            pictures=model_figures(),
        ),
    message:
        "Logging every training to MLflow"
    script:
        "../scripts/track.py"


rule track_studies:
    input:
        **pictures(f"study-{study}" for study in VALUES["study"]),
        store=f"{R}/mlflow/store.json",
        runs=every("join_study", "runs"),
        times=every("join_study", "times"),
        joined=every("join_study", "provenance"),
        records=[of_study(study, "provenance")[0] for study in VALUES["study"]],
    output:
        runs=expand(f"{R}/mlflow/study-{{study}}.json", study=VALUES["study"]),
        provenance=f"{R}/mlflow/studies.provenance.json",
    log:
        f"{R}/logs/track_studies.log",
    benchmark:
        f"{R}/benchmarks/track_studies.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=30,
    params:
        job=job(
            "track_studies",
            SETTINGS["tracking"],
            dataset=settings.dataset,
            protocol=protocol(),
            studies=SETTINGS["studies"],
        ),
    message:
        "Logging the studies to MLflow"
    script:
        "../scripts/track_studies.py"


rule track_experiment:
    input:
        store=f"{R}/mlflow/store.json",
        runs=f"{R}/{{experiment}}/runs.csv",
        times=f"{R}/{{experiment}}/times.csv",
        joined=f"{R}/{{experiment}}/provenance.json",
        record=lambda w: every(w.experiment, "provenance")[0],
        pictures=f"{R}/figures/{{experiment}}.png",
        captions=f"{R}/figures/{{experiment}}.json",
    output:
        runs=f"{R}/mlflow/{{experiment}}.json",
        provenance=f"{R}/mlflow/{{experiment}}.provenance.json",
    log:
        f"{R}/logs/track_experiment/{{experiment}}.log",
    benchmark:
        f"{R}/benchmarks/track_experiment/{{experiment}}.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=30,
    params:
        job=lambda w: job(
            "track_experiment",
            SETTINGS["tracking"],
            dataset=settings.dataset,
            experiment=w.experiment,
        ),
    message:
        "Logging the experiment {wildcards.experiment} to MLflow"
    script:
        "../scripts/track_experiment.py"


rule register:
    input:
        runs=f"{R}/mlflow/runs.json",
        tunings=every("tune", "tuning"),
        models=every("tune", "model"),
        scores=every("evaluate", "scores"),
    output:
        registry=f"{R}/mlflow/registry.json",
        provenance=f"{R}/mlflow/registry.provenance.json",
    log:
        f"{R}/logs/register.log",
    benchmark:
        f"{R}/benchmarks/register.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        job=job(
            "register",
            SETTINGS["tracking"],
            dataset=settings.dataset,
            results=results_of(),
        ),
    message:
        "Registering the best models in MLflow"
    script:
        "../scripts/register.py"
