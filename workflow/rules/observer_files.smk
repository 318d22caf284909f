"""The files of observers and of what follows from them, for the rules of training (``observers.smk``) and of
prediction."""

OBSERVED = {observer.name: observer for observer in settings.observers}
SEED = settings.seeds[0]


def finds(w):
    return OBSERVED[w.observer].target


def grid_of(w):
    return OBSERVED[w.observer].grid().model_dump(mode="json")


def split_of(observer):
    own = OBSERVED[observer].split
    return SETTINGS["split"] if own is None else own.model_dump(mode="json")


def squares_of(output):
    """An output of the squares of an observer in each training survey."""
    return lambda w: every("squares", output, observer=[w.observer])


def square_voxels_of(output):
    """An output of the voxels of these squares."""
    return lambda w: every("square_voxels", output, observer=[w.observer])


def observer_files():
    """The models that predict together with that of towers."""
    return [f"{R}/models/{name}.json" for name in settings.predict.observers]


def line_tables():
    """The tables of the lines of a survey, by the names of the outputs; none without an observer of wires."""
    if not settings.finds_lines():
        return {}
    captions = {
        "spans": "prediction-spans",
        "conductors": "prediction-conductors",
        "clearances": "prediction-clearances",
    }
    return {
        name: in_report(
            f"{R}/predict/{{survey}}/{{survey}}.{name}.csv",
            caption,
            "predictions",
            "Files",
            {"survey": "{survey}", "file": name.capitalize()},
        )
        for name, caption in captions.items()
    }
