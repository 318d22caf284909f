"""What all rules share: the configuration, the surveys, and the identity of a job."""

import json
import re
from functools import cache
from pathlib import Path

from snakemake.exceptions import WorkflowError

from scenenet.core.code_hash import code_hash
from scenenet.config.schema import load
from scenenet.core.errors import InputError
from scenenet.figures import CROP_RANKS, plan
from scenenet.core.files import digest
from scenenet.core.provenance import fingerprint
from scenenet.results.folder import Results
from scenenet.config.survey_sheet import read_surveys
from scenenet.results.tables import TABLES as TABLE_NAMES

try:
    settings = load(config)
    SURVEYS = {survey.name: survey for survey in read_surveys(settings)}
    THESIS = {"thesis": fingerprint(settings.thesis)}
except InputError as error:
    raise WorkflowError(str(error)) from None

R = settings.results_dir
SETTINGS = settings.plain()
SCRIPTS = Path(workflow.basedir) / "workflow" / "scripts"
# Sorted, so that the order of the rows decides on nothing.
TRAIN = sorted(name for name, survey in SURVEYS.items() if survey.role == "train")
NEW = sorted(name for name, survey in SURVEYS.items() if survey.role == "new")
GRID = settings.voxels.label

if not TRAIN:
    raise WorkflowError(
        "no survey has the role train, so there is nothing to learn from. Add a labelled survey to "
        f"{settings.surveys or 'a survey sheet'}, or set ts40k_dir. To classify a survey with a "
        "model that is there already: scenenet predict SURVEY --model MODEL.json --out FOLDER"
    )


def any_of(names):
    """A regular expression for a wildcard that is one of ``names``; without names, for nothing."""
    return "|".join(map(re.escape, names)) or "(?!)"


def models_of(kind):
    return [model.name for model in settings.models if model.kind == kind]


wildcard_constraints:
    survey=any_of(SURVEYS),
    synthetic=any_of(survey.name for survey in settings.synthetic.surveys),
    model=any_of(model.name for model in settings.models),
    contest=any_of(settings.contests()),
    study=any_of(study.name for study in settings.studies),
    seed=r"\d+",


@cache
def code_of(script):
    """Digest of a script and of all the code of the package that it uses."""
    return code_hash([SCRIPTS / f"{script}.py"])


def job(stage, settings, **identity):
    """The parameter of a job: all that decides on its result besides the files that other jobs
    made. It is one dict, sorted and of plain values, because Snakemake compares the parameters of a
    rule as a set, in which two that are swapped look the same."""
    parts = {"stage": stage, "settings": settings, "code": code_of(stage), **identity}
    return json.loads(json.dumps(parts, sort_keys=True))


def source(survey):
    """A survey as an input. One that somebody brought counts by its content, which is among the
    parameters (see ``source_print``), and not by its date."""
    path = SURVEYS[survey].path
    return path if SURVEYS[survey].origin == "synthetic" else ancient(path)


@cache
def source_print(survey):
    """What a survey is known by: its fingerprint, or what a synthetic one is made from."""
    if SURVEYS[survey].origin == "synthetic":
        return f"recipe:{digest(synthetic_settings(Path(SURVEYS[survey].path).stem))}"
    return fingerprint(SURVEYS[survey].path, settings.content_below * 1024**2)


def synthetic_settings(name):
    return settings.synthetic_named(name).model_dump(mode="json")


def model_settings(name):
    return settings.model_named(name).model_dump(mode="json")


def suffix_of(model):
    return ".json" if settings.model_named(model).kind == "scenenet" else ".safetensors"


def tuned_file(model, seed):
    return f"{R}/models/{model}/seed-{seed}{suffix_of(model)}"


def champion_file(model):
    return f"{R}/models/{model}{suffix_of(model)}"


include: "gathered.smk"
include: "shown.smk"
