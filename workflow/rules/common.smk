"""What all rules share: the configuration, the surveys, and the identity of a job.

Paths of the workflow itself start from its own folder, so that another repository can use it as a
module. Paths of surveys and results start from the working directory.
"""

import json
import re
from functools import cache
from pathlib import Path

import yaml
from snakemake.exceptions import WorkflowError
from snakemake.logging import logger

from scenenet.core.code_hash import code_hash
from scenenet.config.review_files import find_reviews
from scenenet.config.schema import load
from scenenet.config.written import geneos_in, merged
from scenenet.core.errors import InputError
from scenenet.figures import CROP_RANKS
from scenenet.core.files import digest
from scenenet.core.provenance import fingerprint
from scenenet.review.decisions import about_conductors
from scenenet.results.tables import print_scores
from scenenet.config.read_surveys import read_surveys
from scenenet.config.tile_plan import NEIGHBOURS_M, HeaderCache, plan_tiles
from scenenet.config.unusable import print_failed, unusable_surveys

WORKFLOW = Path(workflow.current_basedir).parent
PROJECT = WORKFLOW.parent


def with_defaults(given):
    """A configuration, completed with the one that comes with the workflow."""
    complete = {}
    for name in ("studies.yaml", "config.yaml"):
        defaults = yaml.safe_load((PROJECT / "config" / name).read_text(encoding="utf-8"))
        complete = merged(complete, defaults)
    return merged(complete, given)


def own_file(path):
    """A file that the configuration names, or the one that comes with the workflow if the working
    directory has none. It stays where it is when a module is used with a prefix."""
    return local(path if Path(path).exists() else str(PROJECT / path))


def warn_once(text):
    """Show a warning, but not again in the processes of the jobs."""
    if workflow.is_main_process:
        logger.warning(text)


def any_of(names):
    """A regular expression for a wildcard that is one of ``names``; without names, for nothing."""
    return "|".join(re.escape(str(name)) for name in names) or "(?!)"


def trained_on(survey):
    return SURVEYS[survey].role == "train"


def has_map(survey):
    """Whether a map of the survey can be drawn: TS40K samples are single crops, and a temporary
    survey would be made again, with all that follows from it."""
    path = SURVEYS[survey].path
    if SURVEYS[survey].origin == "synthetic" and settings.synthetic.temporary:
        return False
    return not Path(path).is_dir() and not path.endswith((".npy", ".pt"))


@cache
def code_of(script):
    """Digest of a script and of all the code of the package that it uses."""
    return code_hash([WORKFLOW / "scripts" / f"{script}.py"])


def kernels_of(identity):
    """What identifies the kernels from outside the package that the settings of a job name. Jobs
    that read a model run after its training, so its kernels are not among their parameters."""
    named = {name: KERNELS[name] for name in geneos_in(identity) if name in KERNELS}
    return {"kernels": named} if named else {}


def job(stage, settings, **identity):
    """The parameter of a job: all that decides on its result besides the files that other jobs
    made. It is one dict, sorted and of plain values, because Snakemake compares the parameters of a
    rule as a set, in which two that are swapped look the same."""
    parts = {"stage": stage, "settings": settings, "code": code_of(stage), **identity}
    parts |= kernels_of([settings, identity])
    return json.loads(json.dumps(parts, sort_keys=True))


def source(survey):
    """A survey as an input. A recorded survey is known by its content, which is among the parameters
    (see ``source_print``), and not by its date; a prefix of a module does not move it."""
    path = SURVEYS[survey].path
    return path if SURVEYS[survey].origin == "synthetic" else ancient(local(path))


def given_system(survey):
    """The coordinate system that the sheet names for a survey, for the parameters of its jobs."""
    crs = SURVEYS[survey].crs
    return {} if crs is None else {"crs": crs}


def source_print(survey):
    """What identifies a survey: its fingerprint, or the recipe of a synthetic one."""
    if SURVEYS[survey].origin == "synthetic":
        return f"recipe:{digest(synthetic_settings(Path(SURVEYS[survey].path).stem))}"
    return content_of(SURVEYS[survey].path)


@cache
def content_of(path):
    """The fingerprint of a file that a user gives."""
    try:
        return fingerprint(path, settings.content_below * 1024**2)
    except InputError:
        return "unreadable"  # its own jobs fail and say why, and no other


def tower_list(survey):
    """What ``scenenet.review`` reads of a prediction: the list and the files beside it."""
    folder = f"{R}/predict/{survey}/{survey}"
    return {
        "table": f"{folder}.towers.csv",
        "summary": f"{folder}.summary.json",
        "geopackage": f"{folder}.gpkg",
    }


def truth_of(survey):
    """The file with the true classes of a survey, in a list; an empty one for a recorded survey."""
    truth = str(Path(SURVEYS[survey].path).with_suffix(".truth.laz"))
    return [truth] if SURVEYS[survey].origin == "synthetic" else []


def source_prints(survey):
    """What identifies a survey and its truth, which one recipe makes."""
    return dict.fromkeys(("survey", "truth"), source_print(survey))


def synthetic_settings(name):
    return settings.synthetic_named(name).model_dump(mode="json")


def model_settings(name):
    return settings.model_named(name).model_dump(mode="json")


def study_settings(name):
    return settings.study_named(name).model_dump(mode="json")


def made_for_crops(file):
    """A file of a synthetic survey, which is large and may be of no use after its crops are cut."""
    return temp(file) if settings.synthetic.temporary else file


def models_of(kind):
    return [model.name for model in settings.models if model.kind == kind]


def tuning_of(model):
    """The settings of the tuning. The rules of detection matter where whole towers are scored."""
    whole = settings.model_named(model).gives_whole_towers
    return {
        "tuning": SETTINGS["tuning"],
        "detection": SETTINGS["detection"] if whole else None,
    }


def suffix_of(model):
    return MODEL_SUFFIXES[settings.model_named(model).kind]


def tuned_file(model, seed):
    return f"{R}/models/{model}/seed-{seed}{suffix_of(model)}"


def trained_for_components(w):
    """The models of the split, which the workflow has trained; folds are trained in the job."""
    if settings.cross_validation.leave_out or w.component not in VALUES["model"]:
        return []
    return [tuned_file(w.component, seed) for seed in settings.seeds]


def champion_file(model):
    return f"{R}/models/{model}{suffix_of(model)}"


def scheme_of(survey):
    """What the class codes of a survey mean, which lines need; without lines, nothing."""
    return {"codes": SURVEYS[survey].codes} if settings.finds_lines() else {}


def classes_of(survey):
    """What lines need besides the models: the classes of a survey, by which points near a conductor
    are distinguished, and how clearances are measured. Without lines, nothing."""
    if not settings.finds_lines():
        return {}
    return {**scheme_of(survey), "clearance": SETTINGS["clearance"]}


def rejecting(w):
    """The review files that decide about conductors of a survey. They are known by what they say."""
    return [ancient(local(path)) for path in REJECTING.get(w.survey, {})]


def rejects_of(survey):
    """What review files decide about conductors, for the parameters of the jobs that leave those out
    that are rejected; without such a decision, nothing."""
    said = list(REJECTING.get(survey, {}).values())
    return {"rejects": said} if said else {}


def plans_of_tiles():
    """The tiles of each survey that has several files. Their headers are looked at once."""
    cache = HeaderCache(".snakemake/scenenet-tiles.json")
    found = {
        name: plan_tiles(survey, settings.content_below * 1024**2, cache)
        for name, survey in SURVEYS.items()
        if survey.origin == "tiles"
    }
    if workflow.is_main_process:
        cache.save()
    return found


MODEL_SUFFIXES = {"scenenet": ".json", "cnn": ".safetensors"}
# The name of a model has no dot, so this folder is never that of a model.
BOOSTED_TREES = "boosted.trees"
WITHOUT_TRAINING = "without.training"

try:
    settings = load(with_defaults(config))
    SURVEYS = {survey.name: survey for survey in read_surveys(settings, warn=warn_once)}
    THESIS = {"thesis": fingerprint(own_file(settings.thesis))}
    PLANS = plans_of_tiles()
    # Their own jobs fail and say why. The report lists them, and nothing else waits for them.
    FAILED = unusable_surveys(SURVEYS.values())
    KERNELS = settings.outside_kernels()
except InputError as error:
    raise WorkflowError(str(error)) from None

R = settings.results_dir
SETTINGS = settings.plain()
# Settings of a prediction, without the names of the models that predict.
PREDICT = {
    name: value for name, value in SETTINGS["predict"].items() if name not in ("model", "observers")
}
GRID = settings.voxels.label
# Sorted, so that the order of the rows in the survey sheet does not matter.
TRAIN = sorted(filter(trained_on, SURVEYS))
# The surveys that observers are trained on.
OBSERVE = sorted(survey for survey in SURVEYS if SURVEYS[survey].role != "new")
NEW = sorted(set(SURVEYS) - set(OBSERVE))
# New surveys of many files, and of one. Tile by tile there is neither a check nor a picture.
TILED = sorted(PLANS)
WHOLE = [survey for survey in NEW if survey not in PLANS]
# New survey -> the files with what people decided about its towers.
REVIEWS = find_reviews(settings, NEW, ".", warn_once)
# New survey -> those of them that decide about conductors, each with a digest of what it says.
REJECTING = {
    survey: {path: said for path in paths if (said := about_conductors(Path(path)))}
    for survey, paths in REVIEWS.items()
    if settings.finds_lines()
}
EXPERIMENTS = settings.experiments()
CROSS_VALIDATED = {
    **{model.name: model.model_dump(mode="json") for model in settings.crossed_models()},
    BOOSTED_TREES: None,
}
# Trivial answers, rules alone and random parameters come first; these are drawn for the model that predicts.
COMPONENTS = {
    WITHOUT_TRAINING: model_settings(settings.predict.model),
    **{model.name: model.model_dump(mode="json") for model in settings.models},
    BOOSTED_TREES: None,
}

# Job of a study -> the study and the seeds of the job.
STUDY_JOBS = {
    f"{study.name}/{name}": (study.name, list(seeds))
    for study in settings.studies
    for name, seeds in study.jobs(settings.study_job).items()
}

# Wildcard -> its values. A rule that is for some of them only says so in its own constraints.
VALUES = {
    "survey": [*OBSERVE, *NEW],
    "model": [model.name for model in settings.models],
    "observer": [observer.name for observer in settings.observers],
    "seed": list(settings.seeds),
    "study": [study.name for study in settings.studies],
    "study_job": [*STUDY_JOBS],
    "experiment": EXPERIMENTS,
    "contender": [*CROSS_VALIDATED] if "cross_validation" in EXPERIMENTS else [],
    "component": [*COMPONENTS] if "components" in EXPERIMENTS else [],
    "noise_seed": list(settings.label_noise.seeds) if "label_noise" in EXPERIMENTS else [],
}

if not TRAIN:
    raise WorkflowError(
        "no survey has the role train, so there is no training data. Add a labelled survey to "
        f"{settings.surveys or 'a survey sheet'}, or set ts40k_dir. To classify a survey with an "
        "existing model: scenenet predict SURVEY --model MODEL.json --out FOLDER"
    )


wildcard_constraints:
    synthetic=any_of(survey.name for survey in settings.synthetic.surveys),
    survey=any_of(VALUES["survey"]),
    model=any_of(VALUES["model"]),
    observer=any_of(VALUES["observer"]),
    tile=r"[^/].*",
    study=any_of(VALUES["study"]),
    study_job=any_of(VALUES["study_job"]),
    experiment=any_of(VALUES["experiment"]),
    contender=any_of(VALUES["contender"]),
    component=any_of(VALUES["component"]),
    seed=r"\d+",
    noise_seed=r"\d+",
