"""The list of figures of a result folder.

The list follows from the configuration alone, so that the workflow knows every figure before it is
drawn.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
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
    """A figure with its texts.

    Attributes:
        file: the PNG.
        title: a few words.
        alt: description for readers who cannot see it.
        caption: what the figure shows and for which data.
        section: section of the report.
        models: the models that it shows.
        survey: the survey that it shows, if it is only one.
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
    """A figure before it is drawn: its title and section, and how to draw it.

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
    """The figures of a result folder, in the order of the report. Reads no file.

    Args:
        results: the result folder; its files need not exist yet.
        thesis: published numbers, which some figures show.
        sources: survey -> file and codes of its labelled points, for the map of its towers. Folders
            of single crops have no map and are skipped.
    """
    return [
        *_survey_maps(results, sources or {}),
        *_of_dataset(results),
        *_precision_recall(results, thesis),
        *(drawing for model in results.models for drawing in _of_model(results, model, thesis)),
        *_of_crops(results),
        *_of_predictions(results),
        *_of_studies(results, thesis),
        *_of_experiments(results),
    ]


def _survey_maps(results: Results, sources: Mapping[str, Source]) -> Iterator[Drawing]:
    """Maps of whole labelled surveys: their labels, and their towers."""
    for survey, (path, codes) in sources.items():
        if Path(path).suffix.lower() not in (".las", ".laz"):
            continue
        draw = _bind(dataset_figures.draw_labels, survey, path, codes)
        title = f"{survey}, coloured by its labels"
        yield Drawing(f"labels-{survey}", title, "data", draw, survey=survey)
        draw = _bind(dataset_figures.draw_clusters, results, survey, path, codes)
        title = f"Clusters of tower points in {survey}"
        yield Drawing(f"clusters-{survey}", title, "towers", draw, survey=survey)


def _of_dataset(results: Results) -> Iterator[Drawing]:
    if results.surveys:
        draw = _bind(dataset_figures.draw_surveys, results)
        yield Drawing("surveys", "Crops of each survey at the same scale", "data", draw)
    if results.predicting is not None:
        draw = _bind(dataset_figures.draw_grids, results, results.predicting)
        yield Drawing("voxels", "One crop on three grids", "voxels", draw)


def _precision_recall(results: Results, thesis: Thesis | None) -> Iterator[Drawing]:
    if results.models:
        draw = _bind(model_figures.draw_curves, results, thesis)
        models = tuple(results.models)
        yield Drawing("precision-recall", "Precision and recall", "models", draw, models)


def _of_model(results: Results, model: str, thesis: Thesis | None) -> Iterator[Drawing]:
    """Training and kernels of a model; for a SCENE-Net its parameters as well."""
    shown = (model,)
    draw = _bind(model_figures.draw_training, results, model)
    yield Drawing(f"training-{model}", f"Training of {model}", "training", draw, shown)
    draw = _bind(model_figures.draw_kernels, results, model)
    yield Drawing(f"kernels-{model}", f"Kernels of {model}", "learned", draw, shown)
    if results.models[model] != "scenenet":
        return
    draw = _bind(model_figures.draw_parameters, results, model, thesis)
    title = f"Learned parameters of {model}"
    yield Drawing(f"parameters-{model}", title, "learned", draw, shown)
    draw = _bind(model_figures.draw_paths, results, model)
    title = f"Parameters of {model} during training"
    yield Drawing(f"paths-{model}", title, "training", draw, shown)


def _of_crops(results: Results) -> Iterator[Drawing]:
    """Test crops, chosen by the scores of the model that classifies surveys."""
    reference = results.predicting
    if reference is None:
        return
    for rank in CROP_RANKS:
        draw = _bind(crop_figures.draw_crop, results, reference, rank)
        models = tuple(results.models)
        yield Drawing(f"crop-{rank}", f"The {rank} test crop", "crops", draw, models)
    draw = _bind(crop_figures.draw_resolutions, results, reference)
    yield Drawing("resolutions", "One model on two grids", "crops", draw, (reference,))


def _of_predictions(results: Results) -> Iterator[Drawing]:
    for survey in results.predicted:
        draw = _bind(crop_figures.draw_prediction, results, survey)
        title = f"Classification of {survey}"
        yield Drawing(f"prediction-{survey}", title, "predictions", draw, survey=survey)


def _of_studies(results: Results, thesis: Thesis | None) -> Iterator[Drawing]:
    for study in results.studies:
        draw = _bind(model_figures.draw_study, results, study, thesis)
        yield Drawing(f"study-{study.name}", study.title, "studies", draw)


def _of_experiments(results: Results) -> Iterator[Drawing]:
    for name in results.experiments:
        draw = _bind(_draw_experiment, results, name)
        yield Drawing(name, EXPERIMENTS[name].title, name, draw)


def draw_all(planned: Iterable[Drawing], out: str | Path) -> list[Picture]:
    """Draw each figure as ``out/NAME.png``, with its texts in ``out/NAME.json``."""
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
    """The figures called ``names`` that exist in ``folder``, in that order.

    Raises:
        InputError: the texts of a figure exist and its picture does not.
    """
    pictures = []
    for name in names:
        texts = Path(folder) / f"{name}.json"
        if not texts.exists():
            continue
        entry = read_json(texts)
        file = Path(folder) / entry["file"]
        if not file.is_file():
            raise InputError(
                "the picture is missing", file=file, remedy=f"Delete {texts} and run again"
            )
        pictures.append(Picture(**{**entry, "file": file, "models": tuple(entry["models"])}))
    return pictures


def _draw_experiment(results: Results, name: str, out: Path) -> tuple[str, str]:
    return EXPERIMENT_DRAWINGS[name](results.experiment_runs(name), out)


def _bind(draw: Callable[..., tuple[str, str]], *known: Any) -> Callable[[Path], tuple[str, str]]:
    return lambda out: draw(*known, out)
