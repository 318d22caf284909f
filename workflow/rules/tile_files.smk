"""The files of a survey of tiles, for its rules (``tiles.smk``)."""

DENSITY = settings.model_named(settings.predict.model).measurement == "density"
PREDICT = {name: value for name, value in SETTINGS["predict"].items() if name != "model"}


def tile_of(w):
    return PLANS[w.survey].tiles[w.tile]


def work_files(kind):
    """A file of each tile of a survey that can be read, in their order."""
    return lambda w: [
        f"{R}/predict/{w.survey}/work/{tile}.{kind}" for tile in PLANS[w.survey].tiles
    ]


def written_tiles(survey):
    """The names of the tiles of a survey that can be used; known once the towers are found."""
    near = Path(checkpoints.find_towers.get(survey=survey).output.near)
    return [tile for tile in PLANS[survey].tiles if (near / f"{tile}.json").exists()]


TOGETHER = 20
"""Tiles whose jobs of one stage are one job of a scheduler, if its profile says so
(``group-components``)."""
NUMBERS = {survey: {tile: n for n, tile in enumerate(plan.tiles)} for survey, plan in PLANS.items()}


def together(stage):
    """The group of the jobs of a stage: tiles that follow one another. Snakemake joins all
    components of one name again and again, each time that it plans, so the name has the limit."""

    def group(w):
        name = f"{stage}-{w.survey}-{NUMBERS[w.survey][w.tile] // TOGETHER}"
        workflow.parent_groupids[name] = stage
        return name

    return group


def fullest_file(w):
    """The number by which a model scales that measures density; all tiles decide on it."""
    return [f"{R}/predict/{w.survey}/work/fullest.json"] if DENSITY else []


def near_tile(w):
    """The towers that reach into a tile."""
    checkpoints.find_towers.get(survey=w.survey)
    return f"{R}/predict/{w.survey}/near/{w.tile}.json"


def megabytes(start, share):
    """Memory in MB for inputs of a size: more of it each time that a job is tried again."""
    return lambda w, input, attempt: int(attempt * (start + share * input.size_mb))
