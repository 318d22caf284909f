"""Which pictures a result folder gets, and the list of them that the report reads.

The plan follows from the configuration alone, so a workflow can name every picture before it is
drawn.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from scenenet.core.errors import InputError
from scenenet.core.files import read_json, write_json
from scenenet.experiments.published import Thesis
from scenenet.experiments.registry import EXPERIMENTS
from scenenet.figures import crops as crop_figures
from scenenet.figures import dataset as dataset_figures
from scenenet.figures import models as model_figures
from scenenet.figures.experiments import EXPERIMENT_DRAWINGS
from scenenet.results.folder import Results

CROP_RANKS = ("best", "median", "worst")

Source = tuple[str, str]
"""Path of a survey and its class codes."""


@dataclass(frozen=True)
class Picture:
    """One figure with what a reader needs to understand it.

    Attributes:
        file: the PNG.
        title: a few words.
        alt: what is seen, for those who cannot see it.
        caption: what it shows and on what data.
        section: part of the report it belongs to.
        models: the models it shows, if it shows any.
        survey: the survey it shows, if it shows one alone.
    """

    file: Path
    title: str
    alt: str
    caption: str
    section: str
    models: tuple[str, ...] = ()
    survey: str | None = None

    @property
    def name(self) -> str:
        return self.file.stem


@dataclass(frozen=True)
class Drawing:
    """A picture to be: what is known of it beforehand, and how to draw it.

    ``draw`` takes the PNG to write and returns (alternative text, caption).
    """

    name: str
    title: str
    section: str
    draw: Callable[[Path], tuple[str, str]]
    models: tuple[str, ...] = ()
    survey: str | None = None


def plan(
    results: Results, thesis: Thesis | None = None, sources: Mapping[str, Source] | None = None
) -> list[Drawing]:
    """The pictures of a result folder, in the order of the report. Reads nothing.

    Args:
        results: the result folder; its files need not be there yet.
        thesis: published numbers to mark where a picture has a place for them.
        sources: survey -> where its labelled points are, for the map of its towers. Folders of
            single crops have no map and are passed over.
    """
    planned: list[Drawing] = []
    for survey, (path, codes) in (sources or {}).items():
        if Path(path).suffix.lower() in (".las", ".laz"):
            draw = _bind(dataset_figures.draw_clusters, results, survey, path, codes)
            labels = _bind(dataset_figures.draw_labels, survey, path, codes)
            title = f"{survey}, coloured by its labels"
            planned.append(Drawing(f"labels-{survey}", title, "data", labels, survey=survey))
            title = f"Towers of {survey} told apart"
            planned.append(Drawing(f"clusters-{survey}", title, "towers", draw, survey=survey))
    if results.surveys:
        draw = _bind(dataset_figures.draw_surveys, results)
        planned.append(Drawing("surveys", "A crop of each survey, at one scale", "data", draw))
    models = tuple(results.models)
    reference = results.predicting
    if reference is not None:
        draw = _bind(dataset_figures.draw_grids, results, reference)
        planned.append(Drawing("voxels", "One crop on three grids", "voxels", draw))
        draw = _bind(model_figures.draw_curves, results, thesis)
        title = "Precision against recall"
        planned.append(Drawing("precision-recall", title, "models", draw, models))
    for model, kind in results.models.items():
        shown = (model,)
        draw = _bind(model_figures.draw_training, results, model)
        planned.append(Drawing(f"training-{model}", f"Training {model}", "training", draw, shown))
        draw = _bind(model_figures.draw_kernels, results, model)
        title = f"The kernels of {model}"
        planned.append(Drawing(f"kernels-{model}", title, "learned", draw, shown))
        if kind == "scenenet":
            draw = _bind(model_figures.draw_parameters, results, model, thesis)
            title = f"What {model} has learned"
            planned.append(Drawing(f"parameters-{model}", title, "learned", draw, shown))
            draw = _bind(model_figures.draw_paths, results, model)
            title = f"How each parameter of {model} moved"
            planned.append(Drawing(f"paths-{model}", title, "training", draw, shown))
    if reference is not None:
        for rank in CROP_RANKS:
            draw = _bind(crop_figures.draw_crop, results, reference, rank)
            title = f"The {rank} test crop"
            planned.append(Drawing(f"crop-{rank}", title, "crops", draw, models))
        draw = _bind(crop_figures.draw_resolutions, results, reference)
        title = "One crop on two grids, answered by one model"
        planned.append(Drawing("resolutions", title, "crops", draw, (reference,)))
    for survey in results.predicted:
        draw = _bind(crop_figures.draw_prediction, results, survey)
        name = f"prediction-{survey}"
        planned.append(Drawing(name, f"{survey} classified", "predictions", draw, survey=survey))
    for study in results.studies:
        draw = _bind(model_figures.draw_study, results, study, thesis)
        planned.append(Drawing(f"study-{study.name}", study.title, "studies", draw))
    for name in results.experiments:
        draw = _bind(_draw_experiment, results, name)
        planned.append(Drawing(name, EXPERIMENTS[name].title, name, draw))
    return planned


def draw_all(planned: Iterable[Drawing], out: str | Path) -> list[Picture]:
    """Draw each into ``out/NAME.png`` with what is said about it in ``out/NAME.json``."""
    from scenenet.core.progress import track

    pictures = []
    for drawing in track(list(planned), "figures"):
        file = Path(out) / f"{drawing.name}.png"
        alt, caption = drawing.draw(file)
        picture = Picture(
            file, drawing.title, alt, caption, drawing.section, drawing.models, drawing.survey
        )
        write_json(file.with_suffix(".json"), asdict(picture) | {"file": file.name})
        pictures.append(picture)
    return pictures


def read_pictures(folder: str | Path, names: Iterable[str]) -> list[Picture]:
    """The pictures called ``names`` that have been drawn into ``folder``, in that order.

    Raises:
        InputError: a picture is gone while what is said about it is there.
    """
    pictures = []
    for name in names:
        said = Path(folder) / f"{name}.json"
        if not said.exists():
            continue
        entry = read_json(said)
        file = Path(folder) / entry["file"]
        if not file.is_file():
            raise InputError(
                "the picture is missing", file=file, remedy=f"Delete {said} and run again"
            )
        pictures.append(Picture(**{**entry, "file": file, "models": tuple(entry["models"])}))
    return pictures


def _draw_experiment(results: Results, name: str, out: Path) -> tuple[str, str]:
    return EXPERIMENT_DRAWINGS[name](results.experiment_runs(name), out)


def _bind(draw: Callable[..., tuple[str, str]], *known: Any) -> Callable[[Path], tuple[str, str]]:
    return lambda out: draw(*known, out)
