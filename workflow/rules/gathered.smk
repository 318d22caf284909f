"""Lists of what many jobs make, for the rules that gather it."""


def each_training(pattern):
    """``pattern`` for every model and seed."""
    return [
        pattern.format(model=model.name, seed=seed)
        for model in settings.models
        for seed in settings.seeds
    ]


def each_seed_of(model):
    """What a model's best seed is told by, and the models themselves."""
    return [
        file
        for seed in settings.seeds
        for file in (
            f"{R}/evaluate/{model}/seed-{seed}.json",
            f"{R}/tune/{model}/seed-{seed}.json",
            tuned_file(model, seed),
        )
    ]


def gathered(models=None, surveys=TRAIN, predicted=(), studies=(), contests=(), predicts=None):
    """The arguments of ``scenenet.results.folder.Results``. Models are pairs, because their order counts
    and that of a dict does not survive in a parameter."""
    chosen = settings.models if models is None else models
    return {
        "folder": R,
        "models": [[model.name, model.kind] for model in chosen],
        "seeds": list(settings.seeds) if chosen else [],
        "surveys": list(surveys),
        "predicted": list(predicted),
        "studies": [settings.study_named(study).model_dump(mode="json") for study in studies],
        "contests": list(contests),
        "predicts": predicts,
    }


def pictures(names):
    """The two files of each picture."""
    return {
        "pictures": [f"{R}/figures/{name}.png" for name in names],
        "captions": [f"{R}/figures/{name}.json" for name in names],
    }


def print_scores():
    """Show the scores of every model on the terminal, once there are any."""
    import pandas as pd

    if not Path(R, "tables", "models.csv").exists():
        return
    table = pd.read_csv(f"{R}/tables/models.csv")
    columns = ["model", "counted", "precision", "recall", "f05", "iou_tower", "miou"]
    print(f"\nScores on the test crops of {settings.dataset}, {GRID}, tower voxels:")
    print(table[columns].to_string(index=False, float_format="%.3f", na_rep="-"))
    print(f"Report: {R}/report/index.html")


CHECKED = list(SURVEYS)
# TS40K samples are single crops: there is no map to draw.
MAPPED = [
    name
    for name in TRAIN
    if not Path(SURVEYS[name].path).is_dir() and not SURVEYS[name].path.endswith((".npy", ".pt"))
]

CROP_STORES = expand(f"{R}/crops/{{survey}}/crops.zarr.zip", survey=TRAIN)
CROP_MANIFESTS = expand(f"{R}/crops/{{survey}}/manifest.json", survey=TRAIN)
VOXEL_STORES = expand(f"{R}/voxels/{{survey}}/{GRID}/voxels.zarr.zip", survey=TRAIN)
VOXEL_MANIFESTS = expand(f"{R}/voxels/{{survey}}/{GRID}/manifest.json", survey=TRAIN)
CROPS = [*CROP_STORES, *CROP_MANIFESTS]
VOXELS = [*VOXEL_STORES, *VOXEL_MANIFESTS]
CLASS_COUNTS = expand(f"{R}/check/{{survey}}/classes.csv", survey=TRAIN)
TRAININGS = [
    *each_training(f"{R}/train/{{model}}/seed-{{seed}}/history.csv"),
    *each_training(f"{R}/train/{{model}}/seed-{{seed}}/provenance.json"),
]
RESOURCES = each_training(f"{R}/train/{{model}}/seed-{{seed}}/resources.json")
TUNINGS = [
    *each_training(f"{R}/tune/{{model}}/seed-{{seed}}.json"),
    *(tuned_file(model.name, seed) for model in settings.models for seed in settings.seeds),
]
SCORES = each_training(f"{R}/evaluate/{{model}}/seed-{{seed}}.json")
CERTIFICATES = [f"{R}/certificates/{model.name}.json" for model in settings.models]
TIMES = [f"{R}/times/{model.name}.json" for model in settings.models]
BLACK_BOX_TIMES = f"{R}/black_box/times.json"
BOOSTED_TREES = expand(f"{R}/black_box/seed-{{seed}}.json", seed=settings.seeds)
SCENES = expand(f"{R}/scenes/{{rank}}.json", rank=CROP_RANKS)
STUDIED = [study.name for study in settings.studies]
STUDIES = expand(f"{R}/studies/{{study}}/runs.csv", study=STUDIED)
TRACKED_STUDIES = expand(f"{R}/mlflow/study-{{study}}.json", study=STUDIED)
CONTESTS = settings.contests()
CONTEST_RUNS = expand(f"{R}/{{contest}}/runs.csv", contest=CONTESTS)
TRACKED_CONTESTS = expand(f"{R}/mlflow/{{contest}}.json", contest=CONTESTS)
TABLES = expand(
    f"{R}/tables/{{name}}.csv",
    name=[*TABLE_NAMES, *(f"study-{study}" for study in STUDIED), *CONTESTS],
)
COMPARISON = f"{R}/tables/thesis_and_ours.csv"
PROTOCOL = (
    f"{GRID}, split {settings.split.train:.0%} / {settings.split.validation:.0%} / "
    f"{settings.split.test:.0%} by stretch of line"
)

_planned = plan(
    Results(**{**gathered(), "models": {m.name: m.kind for m in settings.models}, "studies": ()})
)
FIGURES = [drawing.name for drawing in _planned]
MODEL_FIGURES = [drawing.name for drawing in _planned if drawing.models]
ALL_PICTURES = [
    *FIGURES,
    *(f"labels-{survey}" for survey in MAPPED),
    *(f"clusters-{survey}" for survey in MAPPED),
    *(f"prediction-{survey}" for survey in NEW),
    *(f"study-{study}" for study in STUDIED),
    *CONTESTS,
]
RECORDS = [
    *expand(f"{R}/check/{{survey}}/provenance.json", survey=CHECKED),
    *expand(f"{R}/{{stage}}/{{survey}}/provenance.json", stage=["towers", "crops"], survey=TRAIN),
    *expand(f"{R}/voxels/{{survey}}/{GRID}/provenance.json", survey=TRAIN),
    f"{R}/split/provenance.json",
    f"{R}/times/grids.provenance.json",
    *each_training(f"{R}/train/{{model}}/seed-{{seed}}/provenance.json"),
    *each_training(f"{R}/tune/{{model}}/seed-{{seed}}.provenance.json"),
    *each_training(f"{R}/evaluate/{{model}}/seed-{{seed}}.provenance.json"),
    *expand(
        f"{R}/{{stage}}/{{model}}.provenance.json",
        stage=["models", "certificates", "times"],
        model=[m.name for m in settings.models],
    ),
    *expand(f"{R}/predict/{{survey}}/provenance.json", survey=NEW),
    *expand(f"{R}/studies/{{study}}/provenance.json", study=STUDIED),
    *expand(f"{R}/{{contest}}/provenance.json", contest=CONTESTS),
    *expand(f"{R}/scenes/{{rank}}.provenance.json", rank=CROP_RANKS),
    f"{R}/black_box/provenance.json",
    f"{R}/tables/provenance.json",
    f"{R}/figures/provenance.json",
    f"{R}/mlflow/provenance.json",
]
