"""MLflow: the store, and a run for every training."""

SQLITE = "sqlite:///"
STORE = {"store": f"{R}/mlflow/store.json"}
if settings.tracking.uri.startswith(SQLITE):
    # Deleting the database makes it, its record and all runs anew. It is updated and not replaced,
    # because it holds the runs of other data and of other people as well; nothing depends on its
    # date, so that what others log does not rerun anything.
    STORE["database"] = settings.tracking.uri.removeprefix(SQLITE)


rule mlflow_store:
    output:
        **{name: update(file) if name == "database" else file for name, file in STORE.items()},
    log:
        f"{R}/logs/mlflow_store.log",
    benchmark:
        f"{R}/benchmarks/mlflow_store.tsv"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        job=job("mlflow_store", SETTINGS["tracking"], studies=[*STUDIED, *CONTESTS]),
    message:
        "Making the MLflow store"
    script:
        "../scripts/mlflow_store.py"


rule track:
    input:
        **pictures(MODEL_FIGURES),
        store=f"{R}/mlflow/store.json",
        trainings=TRAININGS,
        tunings=TUNINGS,
        scores=SCORES,
        black_box=BOOSTED_TREES,
    output:
        runs=f"{R}/mlflow/runs.json",
        provenance=f"{R}/mlflow/provenance.json",
    log:
        f"{R}/logs/track.log",
    benchmark:
        f"{R}/benchmarks/track.tsv"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=30,
    params:
        job=job(
            "track",
            SETTINGS["tracking"],
            dataset=settings.dataset,
            protocol=PROTOCOL,
            common_settings={
                model.name: {"voxels": SETTINGS["voxels"], "split": SETTINGS["split"]}
                for model in settings.models
            },
            results=gathered(),
            pictures=MODEL_FIGURES,
        ),
    message:
        "Logging every training to MLflow"
    script:
        "../scripts/track.py"


rule track_studies:
    input:
        **pictures([f"study-{study}" for study in STUDIED]),
        store=f"{R}/mlflow/store.json",
        runs=STUDIES,
        records=expand(f"{R}/studies/{{study}}/provenance.json", study=STUDIED),
    output:
        runs=TRACKED_STUDIES,
        provenance=f"{R}/mlflow/studies.provenance.json",
    log:
        f"{R}/logs/track_studies.log",
    benchmark:
        f"{R}/benchmarks/track_studies.tsv"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=30,
    params:
        job=job(
            "track_studies",
            SETTINGS["tracking"],
            dataset=settings.dataset,
            protocol=PROTOCOL,
            studies=SETTINGS["studies"],
        ),
    message:
        "Logging the studies to MLflow"
    script:
        "../scripts/track_studies.py"


rule register:
    input:
        runs=f"{R}/mlflow/runs.json",
        tunings=TUNINGS,
        scores=SCORES,
    output:
        registry=f"{R}/mlflow/registry.json",
        provenance=f"{R}/mlflow/registry.provenance.json",
    log:
        f"{R}/logs/register.log",
    benchmark:
        f"{R}/benchmarks/register.tsv"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        job=job("register", SETTINGS["tracking"], dataset=settings.dataset, results=gathered()),
    message:
        "Registering the best models in MLflow"
    script:
        "../scripts/register.py"
