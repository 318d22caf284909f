"""The page that explains every tower of one survey."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path

import numpy as np
import pandas as pd

from scenenet.core.errors import InputError
from scenenet.core.files import write_text
from scenenet.core.outputs import check_space
from scenenet.core.progress import track
from scenenet.core.scratch import scratch_folder, temporary_directory
from scenenet.core.unchanged import unchanged
from scenenet.detection.settings import DetectionSettings
from scenenet.figures import Picture
from scenenet.figures.plots.point_clouds import View, side_views
from scenenet.interpretability.explanations import TowerExplanation, explanations, meanings
from scenenet.models.model_file import ModelCard
from scenenet.pointcloud import iter_chunks
from scenenet.pointcloud.units import METRE, SYMBOLS
from scenenet.prediction.file_status import readable
from scenenet.prediction.predict import SCRATCH_BYTES, predict_survey
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.survey_files import SurveyFiles, look_at
from scenenet.prediction.survey_prediction import SurveyPrediction
from scenenet.prediction.used_models import use_models
from scenenet.prediction.work.survey_system import in_metres
from scenenet.report.blocks import Block, Column, Facts, Figure, Notes, Section, Text, table, write
from scenenet.report.page import render

POINTS_PER_PICTURE = 20_000

FIRST_TOWER_BYTES, POINT_BYTES = 500_000, 2
"""Size of a page: that of a page with one tower, and what each point of the survey adds, because a
longer survey has more towers. Measured pages are a quarter to three quarters as large."""

GENERATOR = "scenenet explain"
"""Mark of the page in its head."""


def is_explanation(path: Path) -> bool:
    """Whether the file is a page that ``explain_survey`` wrote."""
    try:
        with path.open("rb") as stream:
            return f'name="generator" content="{GENERATOR}"'.encode() in stream.read(1000)
    except OSError:
        return False


def explain_survey(
    survey: str | Path | SurveyFiles,
    model: str | Path,
    out: str | Path,
    settings: PredictSettings,
    detection: DetectionSettings,
) -> list[TowerExplanation]:
    """Predict a survey and write a page with the explanation and a picture of every tower.

    Args:
        survey: LAS, LAZ, COPC or TS40K sample; a folder, a pattern or a tile index of LAS and LAZ
            files.
        model: model file with tau.
        out: HTML file to write; it needs no other file and no network.

    Raises:
        InputError: the survey or the model cannot be used.
        OutputError: the page cannot be written, or a disk has too little space.
    """
    if not isinstance(survey, SurveyFiles):
        survey = SurveyFiles.of(survey)
    [used] = use_models(model, settings)
    if not used.target.is_tower:
        raise InputError(
            f"it finds {used.target.name}, and only towers are explained",
            file=model,
            remedy="Name a model of towers",
        )
    headers, _ = look_at(survey)
    points = sum(info.n_points for info in headers.values())
    page = FIRST_TOWER_BYTES + POINT_BYTES * points
    # The pictures are drawn to temporary files.
    check_space({Path(out): page, temporary_directory(): SCRATCH_BYTES * points + page})
    with predict_survey(survey, model, settings, detection) as prediction:
        prediction.warn()
        card = prediction.card
        units = (prediction.unit_sizes, prediction.unit_names)
        explained = explanations(prediction.towers, card, *units)
        with unchanged(*prediction.states):
            surroundings = list(_surroundings(prediction, explained))
    facts = [
        ("points", write(prediction.n_points, "count")),
        ("towers", write(len(explained), "count")),
        ("model", card.name),
        ("tau", write(card.tau, "score")),
        ("voxel size [m]", write(prediction.voxel_size, "metres")),
    ]
    sections = [Section("survey", survey.given.name, [Facts(facts)])]
    with scratch_folder() as scratch:
        for explanation, (xyz, views) in zip(explained, surroundings, strict=True):
            picture = scratch / f"{explanation.id}.png"
            sections.append(_section(explanation, xyz, views, picture))
        numbers = _parameters(meanings(prediction.model, card))
        sections.append(Section("model", f"The model {card.name}", numbers))
        title = f"Why these are towers: {survey.given.name}"
        write_text(out, render(sections, title, GENERATOR, made_by=_origin(card)))
    return explained


def _origin(card: ModelCard) -> str:
    """What made the model, as a sentence; what its file does not say is left out."""
    made_by = card.provenance
    known = [
        text.format(made_by[key])
        for key, text in {
            "protocol": "protocol {}",
            "seed": "seed {}",
            "training_crops": "{} training crops",
            "data": "data {}",
            "config": "configuration {}",
            "version": "scenenet {}",
        }.items()
        if made_by.get(key) is not None
    ]
    return f"Model {card.name}" + (f": {', '.join(known)}." if known else ".")


def _parameters(rows: list[tuple[str, float, str, str]]) -> list[Block]:
    """The table of the parameters of a model; a sentence for a model whose weights mean nothing."""
    if not rows:
        return [Text("The weights of this model have no meaning of their own: no explanation.")]
    frame = pd.DataFrame(rows, columns=["name", "value", "unit", "meaning"])
    columns = [
        Column("name", "parameter"),
        Column("value", "value", "number"),
        Column("unit", "unit"),
        Column("meaning", "meaning"),
    ]
    caption = f"The {len(rows)} parameters that decide, and their meaning."
    return [table(frame, columns, caption, folded=True)]


def _section(
    explanation: TowerExplanation, xyz: np.ndarray, views: list[View], picture: Path
) -> Section:
    planar, vertical = (
        SYMBOLS.get(name, name) for name in (explanation.unit, explanation.vertical_unit)
    )
    facts = [
        (f"x [{planar}]", f"{explanation.x:.2f}"),
        (f"y [{planar}]", f"{explanation.y:.2f}"),
        (f"height [{vertical}]", f"{explanation.height:.1f}"),
        ("probability", write(explanation.probability, "score")),
    ]
    blocks: list[Block] = [Facts(facts), Notes("Measurements", explanation.evidence)]
    if explanation.contributions:
        frame = pd.DataFrame(explanation.contributions, columns=["geneo", "share", "sentence"])
        columns = [
            Column("geneo", "GENEO"),
            Column("share", "share", "score"),
            Column("sentence", "meaning"),
        ]
        caption = "Mean contribution of each GENEO over the detected voxels of the tower."
        blocks.append(table(frame, columns, caption))
    if explanation.doubts:
        blocks.append(Notes("Check this tower", explanation.doubts))
    if len(xyz):
        alt = side_views(xyz, views, picture)
        caption = (
            "The tower and its surroundings from the side: the probability of each point, and how "
            "much each GENEO contributed in favour of a tower."
        )
        if (explanation.unit, explanation.vertical_unit) != (METRE, METRE):
            caption += " Its axes are in m."
        title = f"Tower {explanation.id}"
        blocks.append(Figure(Picture(picture, title, alt, caption, "explanation")))
    return Section(f"tower-{explanation.id}", f"Tower {explanation.id}", blocks)


def _surroundings(
    prediction: SurveyPrediction, towers: Sequence[TowerExplanation]
) -> Iterator[tuple[np.ndarray, list[View]]]:
    """For each tower the points (n, 3) m within its height in plan, and the views of them."""
    sizes = prediction.unit_sizes
    planar, _, vertical = sizes
    kept: list[list[np.ndarray]] = [[np.empty((0, 4 + len(prediction.geneos)))] for _ in towers]
    chunks = chain.from_iterable(iter_chunks(file.path) for file, _ in readable(prediction.files))
    for chunk in track(chunks, "pictures: chunks read"):
        for tower, parts in zip(towers, kept, strict=True):
            apart = np.hypot(chunk.xyz[:, 0] - tower.x, chunk.xyz[:, 1] - tower.y) * planar
            xyz = chunk.xyz[apart <= tower.height * vertical]
            points = prediction.look_up(xyz)
            places = in_metres(xyz, sizes)
            parts.append(np.column_stack([places, points.probability, points.shares]))
    for parts in kept:
        rows = np.concatenate(parts)
        rows = rows[:: max(1, len(rows) // POINTS_PER_PICTURE)]
        names = ["tower probability", *(geneo.replace("_", " ") for geneo in prediction.geneos)]
        views = [
            View(name, column.clip(0, 1), "probability")
            for name, column in zip(names, rows.T[3:], strict=True)
        ]
        yield rows[:, :3], views
