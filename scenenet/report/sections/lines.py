"""The sections on observers and on the lines that follow from them: spans, conductors and what is
near them."""

from __future__ import annotations

from collections.abc import Iterator

import pandas as pd

from scenenet.clearance.records import SPAN_CLEARANCE_COLUMNS
from scenenet.core.columns import FieldColumn
from scenenet.line.records import AS_FLOWN, SPAN_COLUMNS
from scenenet.report.blocks import (
    Block,
    Column,
    Facts,
    Format,
    Heading,
    Section,
    Text,
    table,
    write,
)
from scenenet.report.context import ReportContext, against, against_each
from scenenet.results.folder import Prediction

WORST_LISTED = 10
"""Rows of the table of clearances of a survey on the page, which has the worst first; the file has
all spans."""

LINE_FACTS = ("lines", "spans", "conductors", "earth_wires", "cables", "to_look_at")
"""Numbers of ``PredictionSummary.line`` on the page."""

POINT_COLUMNS: tuple[tuple[str, str, Format], ...] = (
    ("precision", "precision", "score"),
    ("recall", "recall", "score"),
    ("iou", "IoU", "score"),
    ("n_true", "points of the target", "count"),
    ("n_predicted", "points found", "count"),
)
"""Scores of points on the page: column, heading and how it is written."""

FORMATS: dict[str, Format] = {"m": "metres", "": "text", "degrees": "metres", "1": "score"}
"""How a table of the line writes the values of a column, by its unit."""

DISTANCES = ("worst_margin", "ground", "vegetation", "building", "wire", "fall_margin")
"""Columns of the clearances on the page that need the heading of their name."""


def observers(context: ReportContext) -> Section | None:
    """The models of other targets than towers, with their scores."""
    frame = context.table("observers")
    if frame is None:
        return None
    scores = [Column(f"point_{name}", label, how) for name, label, how in POINT_COLUMNS]
    columns = [
        Column("observer", "observer"),
        Column("model", "model"),
        Column("target", "finds"),
        Column("parameters", "parameters", "count"),
        Column("squares", "test squares", "count"),
        Column("tau", "tau", "score"),
        *against_each(scores, against(frame, "point_iou")),
    ]
    caption = (
        "Observers: a point counts as found if its voxel reaches tau. They were trained on squares "
        "of the training surveys, and scored on other squares of these. Boosted trees learn from "
        "the same squares; every point is the trivial answer, that each point is the target."
    )
    return Section("observers", "Observers", [table(frame, columns, caption, _file("observers"))])


def lines(context: ReportContext) -> Section | None:
    """The spans and the worst clearances of every classified survey."""
    blocks: list[Block] = []
    for survey in context.results.predicted:
        found = context.results.prediction(survey)
        if found is not None and found.summary.line is not None:
            blocks += [Heading(survey), *_survey(survey, found)]
    if not blocks:
        return None
    note = Text(
        "Spans and conductors of the surveys, traced in the points of wires between the towers "
        f"found, and what is near them. {AS_FLOWN.capitalize()}. They have not been confirmed."
    )
    return Section("lines", "Lines", [note, *blocks])


def _survey(survey: str, found: Prediction) -> Iterator[Block]:
    """The blocks of a survey."""
    line = found.summary.line or {}
    facts = [(name.replace("_", " "), write(line[name], "count")) for name in LINE_FACTS]
    counted = line["clearances"] or {}
    for name, label in (("dangers", "places closer than the limits"), ("fall_trees", "fall trees")):
        if name in counted:
            facts.append((label, write(counted[name], "count")))
    if counted.get("limits"):
        facts.append(("limits", counted["limits"]))
    yield Facts(facts)
    if found.spans is None or found.spans.empty:
        yield Text(f"No span was found in {survey}.")
        return
    listed = [column for column in SPAN_COLUMNS if column.heading is not None]
    caption = f"Spans of {survey} in their order along each line."
    yield table(found.spans, list(map(_column, listed)), caption, _of(survey, "spans"), folded=True)
    if found.clearances is not None and not found.clearances.empty:
        yield _worst(survey, found.clearances)


def _worst(survey: str, clearances: pd.DataFrame) -> Block:
    """The spans with the worst clearances."""
    shown = clearances.head(WORST_LISTED)
    listed = [
        column
        for column in SPAN_CLEARANCE_COLUMNS
        if column.heading is not None or column.name in DISTANCES
    ]
    caption = (
        f"Clearances of {survey}, the worst first: distance of what is nearest to a conductor of "
        f"the span. {AS_FLOWN.capitalize()}."
    )
    if len(clearances) > len(shown):
        caption += f" The first {len(shown)} of {len(clearances)} spans."
    return table(shown, list(map(_column, listed)), caption, _of(survey, "clearances"))


def _column(column: FieldColumn) -> Column:
    heading = column.heading or column.name.replace("_", " ")
    unit = f" [{column.unit}]" if column.unit else ""
    return Column(column.name, f"{heading}{unit}", FORMATS[column.unit])


def _file(name: str) -> str:
    return f"tables/{name}.csv"


def _of(survey: str, name: str) -> str:
    return f"predict/{survey}/{survey}.{name}.csv"
