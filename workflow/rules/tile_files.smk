"""The files of a survey of tiles, for its rules (``tiles.smk``)."""

DENSITY = settings.model_named(settings.predict.model).measurement == "density"


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
    components of one name again and again, each time that it plans, so the name has the limit.

    None inside the job of a scheduler, where the group is no longer needed (``tiles.smk``)."""
    if workflow.remote_exec:
        return None

    def group(w):
        name = f"{stage}-{w.survey}-{NUMBERS[w.survey][w.tile] // TOGETHER}"
        workflow.parent_groupids[name] = stage
        return name

    return group


def fullest_file(w):
    """The number by which a model scales that measures density; all tiles decide on it."""
    return [f"{R}/predict/{w.survey}/work/fullest.json"] if DENSITY else []


def near_tile(w):
    """The towers that reach into a tile; where lines are found, those that they asked for as well, and
    the conductors."""
    if settings.finds_lines():
        checkpoints.conductors.get(survey=w.survey)
        return f"{R}/predict/{w.survey}/near_line/{w.tile}.json"
    checkpoints.find_towers.get(survey=w.survey)
    return f"{R}/predict/{w.survey}/near/{w.tile}.json"


def observed_tiles(name):
    """What an observer predicts for each tile of a survey that can be read, in their order."""
    return lambda w: [
        f"{R}/predict/{w.survey}/observed/{name}/{tile}.predictions"
        for tile in PLANS[w.survey].tiles
    ]


def observed_by_all(w):
    """What all observers predict for the tiles of a survey, observer by observer."""
    return [file for name in settings.predict.observers for file in observed_tiles(name)(w)]


def of_line(file):
    """A file of the lines of a survey, in a list; an empty one without lines."""
    return [f"{R}/predict/{{survey}}/work/{file}"] if settings.finds_lines() else []


def observed_voxels():
    """The voxels of each observer that predicts, from its settings: another model of the same settings
    must not read all tiles again."""
    return [
        (
            [observer.grid().voxel_size, model.metric.observed]
            if (model := observer.model()).protocol == "operational"
            else [observer.grid().voxel_size, None]
        )
        for observer in settings.predicting_observers()
    ]


def needs_classes():
    """What is read of the points of a survey besides their places."""
    return {"classes": True} if settings.finds_lines() else {}


def megabytes(start, share):
    """Memory in MB for inputs of a size: more of it each time that a job is tried again."""
    return lambda w, input, attempt: int(attempt * (start + share * input.size_mb))
