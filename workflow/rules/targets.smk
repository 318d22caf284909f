"""The files that many jobs make, for the rules that read all of them.

They are derived from the outputs of the rules and the values of the wildcards, so a new rule or output
is a target without being listed anywhere.
"""

import re

from snakemake.io import is_flagged

from scenenet.figures import plan
from scenenet.results.folder import Results
from scenenet.results.tables import COMPARISONS, DATASET_TABLES, TABLES


def every(stage, output, **values):
    """Every file of an output of a stage: one for each combination of the values of its wildcards.

    Args:
        stage: name of a rule, or what the rules of both kinds of models are called without the kind.
        output: name of the output.
        values: wildcard -> values, if not all of them.
    """
    names = [stage] if rules.has(stage) else [f"{stage}_{kind}" for kind in MODEL_SUFFIXES]
    return [file for name in names for file in _files(getattr(rules, name), output, values, FAILED)]


def every_prediction(output):
    """An output of every new survey, of one file or of many."""
    stages = ["predict", "survey_lists"] if TILED else ["predict"]
    return [file for stage in stages for file in every(stage, output)]


def every_written_tile(w):
    """What is written for each tile that can be used; known once the towers are found."""
    return [
        file
        for survey in TILED
        for tile in written_tiles(survey)
        for pattern in rules.write_tile.output
        for file in expand(pattern, survey=survey, tile=tile)
    ]


def of_boosted_trees(output, stage="boosted_trees"):
    """An output of the boosted trees, or of those beside the observers (stage ``observer_trees``); nothing where
    they are not trained."""
    return every(stage, output) if settings.boosted_trees else []


def of_study(study, output):
    """The files of an output of the jobs of a study."""
    jobs = [job for job, (name, _) in STUDY_JOBS.items() if name == study]
    return every("study", output, study_job=jobs)


def every_output():
    """Rule -> every file that it makes, for all rules so far. Written tiles are known later
    (``every_written_tile``). Synthetic surveys are not targets: what
    is made from them is complete without them, and to make one again would train everything again.
    """
    return {
        name: [file for output in rule.output.keys() for file in _files(rule, output, {})]
        for name, rule in rules._rules.items()
        if "synthetic" not in rule.rule.wildcard_names and name != "write_tile"
    }


def every_record():
    """The provenance record of every job of the rules so far."""
    return [
        file
        for rule in rules._rules.values()
        if "provenance" in rule.output.keys() and "synthetic" not in rule.rule.wildcard_names
        for file in _files(rule, "provenance", {}, FAILED)
    ]


def _files(rule, output, values, failed=()):
    patterns, declared = (getattr(of.output, output) for of in (rule, rule.rule))
    if "tile" in rule.rule.wildcard_names:
        each = [(survey, tile) for survey in TILED for tile in PLANS[survey].tiles]
        observed = "observer" in rule.rule.wildcard_names
        others = {"observer": settings.predict.observers} if observed else {}
        return [
            file
            for survey, tile in each
            for file in expand(patterns, survey=survey, tile=tile, **others)
        ]
    single = isinstance(patterns, str)
    files = expand(
        list([patterns] if single else patterns), **{**_wildcards(rule, failed), **values}
    )
    # The outputs that ``rules`` hands on have lost this flag.
    return [local(file) for file in files] if single and is_flagged(declared, "local") else files


def _wildcards(rule, failed=()):
    """Wildcard -> its values in the outputs of a rule, without surveys that failed."""
    limits = rule.rule.wildcard_constraints
    return {
        name: [
            value
            for value in values
            if re.fullmatch(limits.get(name, ".*"), str(value))
            and not (name == "survey" and value in failed)
        ]
        for name, values in VALUES.items()
        if name in rule.rule.wildcard_names
    }


def every_picture(output):
    """The pictures of all rules so far that draw, or their captions."""
    drawing = [name for name, rule in rules._rules.items() if output in rule.output.keys()]
    return [file for name in drawing for file in every(name, output)]


def table_names():
    """Stems of the tables that models decide, apart from the comparisons with the thesis."""
    made = [name for name in TABLES if name not in DATASET_TABLES]
    return [*made, *(f"study-{study}" for study in VALUES["study"]), *EXPERIMENTS]


def each_seed_of(model):
    """What the best seed of a model is chosen by, and the models themselves."""
    return [
        file
        for seed in settings.seeds
        for file in (
            f"{R}/evaluate/{model}/seed-{seed}.json",
            f"{R}/tune/{model}/seed-{seed}.json",
            tuned_file(model, seed),
        )
    ]


def results_of(
    models=None,
    surveys=TRAIN,
    predicted=(),
    studies=(),
    experiments=(),
    predicts=None,
    observers=(),
    observed=(),
):
    """The arguments of ``scenenet.results.folder.Results`` besides its folder. Models are pairs, because their
    order counts and that of a dict does not survive in a parameter."""
    chosen = settings.models if models is None else models
    return {
        "models": [[model.name, model.kind] for model in chosen],
        "seeds": list(settings.seeds) if [*chosen, *observers] else [],
        "surveys": list(surveys),
        "predicted": list(predicted),
        "studies": [study_settings(study) for study in studies],
        "experiments": list(experiments),
        "predicts": predicts,
        "observers": list(observers),
        "observed": list(observed),
    }


def all_results():
    return results_of(
        predicted=[survey for survey in NEW if survey not in FAILED],
        studies=VALUES["study"],
        experiments=EXPERIMENTS,
        predicts=settings.predict.model,
        observers=VALUES["observer"],
        observed=[survey for survey in OBSERVE if not trained_on(survey)],
    )


@cache
def dataset_figures():
    """The figures of the data set and of the models, which one job draws."""
    arguments = results_of()
    return plan(
        Results(**{**arguments, "folder": R, "models": dict(arguments["models"]), "studies": ()})
    )


def model_figures():
    return [drawing.name for drawing in dataset_figures() if drawing.models]


def pictures(names):
    """The two files of each picture."""
    return {
        "pictures": [f"{R}/figures/{name}.png" for name in names],
        "captions": [f"{R}/figures/{name}.json" for name in names],
    }


def protocol():
    """Grid and split, as MLflow shows them."""
    return (
        f"{GRID}, split {settings.split.train:.0%} / {settings.split.validation:.0%} / "
        f"{settings.split.test:.0%} by stretch of line"
    )
