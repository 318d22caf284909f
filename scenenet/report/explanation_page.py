"""The page that answers "why is this a tower?" for one survey."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from scenenet.core.files import read_json, write_text
from scenenet.core.progress import track
from scenenet.detection.settings import DetectionSettings
from scenenet.figures import Picture
from scenenet.figures.plots.point_clouds import View, side_views
from scenenet.interpretability.explanations import Receipt, meanings, receipts
from scenenet.models.model_file import read_model
from scenenet.prediction.predict import predict_survey
from scenenet.prediction.settings import PredictSettings
from scenenet.report.blocks import Block, Column, Facts, Figure, Notes, Section, Text, table, write
from scenenet.report.page import render

POINTS_A_PICTURE = 20_000


def explain_survey(
    survey: str | Path,
    model: str | Path,
    out: str | Path,
    settings: PredictSettings,
    detection: DetectionSettings,
) -> list[Receipt]:
    """Predict a survey and write a page with the receipt and a picture of every tower.

    Args:
        survey: LAS, LAZ, COPC or TS40K sample.
        model: model file with tau.
        out: HTML file to write; needs no other file and no network.

    Raises:
        InputError: the survey or the model cannot be used.
    """
    trained, card = read_model(model)
    with tempfile.TemporaryDirectory(prefix="scenenet-") as scratch:
        folder = Path(scratch)
        laz, geojson = folder / "survey.laz", folder / "towers.geojson"
        summary = predict_survey(
            survey, model, laz, geojson, folder / "summary.json", settings, detection
        )
        found = receipts(read_json(geojson), trained, card)
        surroundings = _surroundings(laz, found)
        blocks: list[Block] = [
            Facts(
                [
                    ("points", write(summary["points"], "count")),
                    ("towers", write(len(found), "count")),
                    ("model", card.name),
                    ("tau", write(card.tau, "score")),
                    ("voxel [m]", write(summary["voxel_size_m"], "metres")),
                ]
            )
        ]
        blocks += _numbers(meanings(trained, card))
        sections = [Section("survey", Path(survey).name, blocks)]
        for receipt, (xyz, views) in zip(found, surroundings, strict=True):
            picture = folder / f"{receipt.id}.png"
            sections.append(_section(receipt, xyz, views, picture))
        title = f"Why these are towers: {Path(survey).name}"
        write_text(out, render(sections, title, f"model {card.name}, {card.provenance}"))
    return found


def _numbers(rows: list[tuple[str, float, str, str]]) -> list[Block]:
    """The table of a model's numbers; nothing for a model whose numbers have no meaning."""
    if not rows:
        return [Text("This model has no parts with a meaning, so it can give no reason.")]
    frame = pd.DataFrame(rows, columns=["name", "value", "unit", "meaning"])
    columns = [
        Column("name", "number"),
        Column("value", "value", "number"),
        Column("unit", "unit"),
        Column("meaning", "what it is"),
    ]
    return [table(frame, columns, "The numbers that decide, and what they mean.")]


def _section(receipt: Receipt, xyz: np.ndarray, views: list[View], picture: Path) -> Section:
    blocks: list[Block] = [
        Facts(
            [
                ("x [m]", f"{receipt.x:.2f}"),
                ("y [m]", f"{receipt.y:.2f}"),
                ("height [m]", f"{receipt.height:.1f}"),
                ("probability", write(receipt.probability, "score")),
            ]
        )
    ]
    blocks.append(Notes("What stands there", receipt.evidence))
    if receipt.contributions:
        frame = pd.DataFrame(receipt.contributions, columns=["geneo", "share", "said"])
        columns = [
            Column("geneo", "GENEO"),
            Column("share", "share", "score"),
            Column("said", "what it says"),
        ]
        blocks.append(table(frame, columns, "Who contributed what, over the tower's voxels."))
    if receipt.doubts:
        blocks.append(Notes("Look again", receipt.doubts))
    if len(xyz):
        alt = side_views(xyz, views, picture)
        caption = (
            "The tower and its surroundings from the side: the probability of each point, and how "
            "much of the answer each GENEO put in for a tower."
        )
        title = f"Tower {receipt.id}"
        blocks.append(Figure(Picture(picture, title, alt, caption, "receipt")))
    return Section(f"tower-{receipt.id}", f"Tower {receipt.id}", blocks)


def _surroundings(laz: Path, towers: Sequence[Receipt]) -> Iterator[tuple[np.ndarray, list[View]]]:
    """Points (n, 3) within a tower's height of it, and how to colour them, tower by tower."""
    import laspy

    kept: list[list[Any]] = [[] for _ in towers]
    with laspy.open(laz) as reader:
        names = [n for n in reader.header.point_format.extra_dimension_names if _is_answer(n)]
        for chunk in track(reader.chunk_iterator(1_000_000), "pictures: chunks read"):
            xyz = np.stack([chunk.x, chunk.y, chunk.z], axis=1)
            for receipt, parts in zip(towers, kept, strict=True):
                near = np.flatnonzero(
                    np.hypot(xyz[:, 0] - receipt.x, xyz[:, 1] - receipt.y) <= receipt.height
                )
                parts.append(np.column_stack([xyz[near], *(chunk[n][near] for n in names)]))
    for parts in kept:
        rows = np.concatenate(parts)
        rows = rows[:: max(1, len(rows) // POINTS_A_PICTURE)]
        views = [
            View(name.removeprefix("share_").replace("_", " "), column.clip(0, 1), "probability")
            for name, column in zip(names, rows.T[3:], strict=True)
        ]
        yield rows[:, :3], views


def _is_answer(dimension: str) -> bool:
    return dimension == "tower_probability" or dimension.startswith("share_")
