"""Writes the page of a survey: one HTML file that needs no other file and no network."""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from html import escape
from itertools import chain
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any

from scenenet.clearance.sags import with_sags
from scenenet.clearance.settings import ClearanceSettings
from scenenet.core.files import atomic
from scenenet.pointcloud.units import SYMBOLS
from scenenet.prediction.page import markup
from scenenet.prediction.page.budget import PageBudget
from scenenet.prediction.page.frame import MapFrame
from scenenet.prediction.page.line_shapes import note_key
from scenenet.prediction.page.map_shapes import frame_and_shapes
from scenenet.prediction.page.pictures import TowerPicture, tower_pictures
from scenenet.prediction.page.span_facts import SpanFacts, span_facts
from scenenet.prediction.page.span_list import (
    LengthUnits,
    line_data,
    span_headings,
    span_picture,
    span_rows,
)
from scenenet.prediction.page.span_pictures import SpanPicture, span_pictures
from scenenet.prediction.page.survey_facts import (
    counts,
    file_table,
    line_not_seen,
    not_seen,
    parameter_table,
    positions_said,
    warnings,
)
from scenenet.prediction.page.thinning import STEP_M
from scenenet.prediction.page.tower_list import (
    Explained,
    to_check_first,
    tower_data,
    tower_headings,
    tower_picture,
    tower_rows,
)

if TYPE_CHECKING:
    from scenenet.prediction.survey_prediction import SurveyPrediction

ASSETS = Path(__file__).parent / "assets"

_CLASS = re.compile(r'class="([^"]*)"')
STYLES = ("page.css", "line.css")
SCRIPTS = (
    "common.js",
    "list.js",
    "map.js",
    "tower.js",
    "span.js",
    "chart.js",
    "profile.js",
    "page.js",
)
"""Parts of the style and of the script of a page, in their order there."""

PICTURES = "$pictures\n"
"""Where the pictures are in the page."""

PAGE_BYTES = 150_000
"""Size of a page without towers, and of that of a survey that is little more than one tower. What
towers and spans add is less than a hundredth of the points around them."""


@dataclass(frozen=True)
class PageContent:
    """What a page lists of a survey.

    Attributes:
        budget: how much that may be.
        towers: those to check first.
        spans: the worst first; none where no line was looked for.
        doubtful: number of towers of the survey that are to check.
        all_spans: what is known of each span of the survey.
    """

    budget: PageBudget
    towers: Sequence[Explained]
    spans: Sequence[SpanFacts]
    doubtful: int
    all_spans: Sequence[SpanFacts]

    @classmethod
    def of(cls, prediction: SurveyPrediction) -> PageContent:
        towers = to_check_first(prediction)
        spans: list[SpanFacts] = []
        if prediction.line is not None:
            planar = prediction.unit_sizes[0], prediction.unit_names[0]
            spans = span_facts(prediction.line, prediction.clearances, planar)
        budget = PageBudget.of(len(towers), len(spans))
        doubtful = sum(bool(one.doubts) for _, one in towers)
        return cls(budget, towers[: budget.towers], spans[: budget.spans], doubtful, spans)


def write_page(prediction: SurveyPrediction, path: str | Path) -> None:
    """Write the page of a survey. Equal predictions give equal pages.

    Raises:
        OutputError: the page cannot be written.
    """
    flown, prediction = prediction, as_measured(prediction)
    content = PageContent.of(prediction)
    towers = [tower for tower, _ in content.towers]
    spans = [one.span for one in content.spans]
    parts = survey_page(
        prediction, content, tower_pictures(prediction, towers, content.budget),
        span_pictures(flown, spans, content.budget),
    )  # fmt: skip
    with atomic(path) as partial, partial.open("w", encoding="utf-8") as stream:
        stream.writelines(parts)


def survey_page(
    prediction: SurveyPrediction,
    content: PageContent,
    of_towers: Iterable[TowerPicture],
    of_spans: Iterable[SpanPicture] = (),
) -> Iterator[str]:
    """The page of a survey as HTML, part after part: the pictures of a long line take most of it,
    and only one is in memory.

    Args:
        content: what it lists.
        of_towers, of_spans: a picture of each tower and span that it lists.
    """
    planar, _, vertical = (SYMBOLS.get(name, name) for name in prediction.unit_names)
    units = LengthUnits(*prediction.unit_sizes[1:], planar, vertical)
    doubtful = {tower.id: bool(one.doubts) for tower, one in content.towers}
    frame, shapes = frame_and_shapes(prediction, doubtful, content.spans)
    name = prediction.survey.given.name
    style, script = (_joined(files) for files in (STYLES, SCRIPTS))
    caveats = markup.note("What this page does not show", not_seen(prediction.detection))
    if prediction.line is not None:
        caveats += markup.note("What the spans do not show", line_not_seen(prediction))
    subject = "Towers" if prediction.line is None else "Towers and spans"
    values = dict(
        title=escape(f"{subject} of {name}"),
        style=style,
        script=script,
        style_hash=_hash(f"\n{style}"),
        script_hash=_hash(f"\n{script}"),
        facts=markup.facts(counts(prediction, content.doubtful, content.all_spans)),
        warnings=warnings(prediction, content.budget),
        caveat=caveats,
        shapes=shapes,
        **_line_parts(content, units, positions_said(prediction), shapes),
        headings=tower_headings(planar, vertical),
        rows=tower_rows(content.towers),
        files=file_table(prediction.files),
        parameters=parameter_table(prediction),
        data=markup.json_text(_data(prediction, content, frame, units)),
    )
    before, after = _template("page.html").template.split(PICTURES)
    yield Template(before).substitute(values)
    for picture in chain(map(tower_picture, of_towers), map(span_picture, of_spans)):
        yield f"{picture}\n"
    yield Template(after).substitute(values)


def as_measured(prediction: SurveyPrediction) -> SurveyPrediction:
    """The prediction with its conductors where its clearances were measured from."""
    if prediction.line is None or prediction.clearance is None:
        return prediction
    return replace(prediction, line=with_sags(prediction.line, prediction.clearance.sags))


def _line_parts(
    content: PageContent, units: LengthUnits, positions: str, shapes: str
) -> dict[str, str]:
    """The parts of the page about spans; empty where it lists none. The key has what is among the
    ``shapes`` of the map."""
    names = ("tabs", "key", "spans", "skip")
    if not content.spans:
        return {f"line_{name}": "" for name in names}
    classes = set(_CLASS.findall(shapes))
    values = {
        "n_towers": markup.count(len(content.towers)),
        "n_spans": markup.count(len(content.spans)),
        "headings": span_headings(units),
        "rows": span_rows(content.spans, units),
        "caveat": escape(positions),
        "notes": note_key(),
    }
    parts = {f"line_{name}": _template(f"line_{name}.html").substitute(values) for name in names}
    entries = parts["line_key"].splitlines(keepends=True)
    parts["line_key"] = "".join(e for e in entries if set(_CLASS.findall(e)) & classes)
    return parts


def _template(name: str) -> Template:
    return Template((ASSETS / name).read_text("utf-8"))


def _joined(files: Sequence[str]) -> str:
    return "\n".join((ASSETS / file).read_text("utf-8") for file in files)


def _data(
    prediction: SurveyPrediction, content: PageContent, frame: MapFrame, units: LengthUnits
) -> dict[str, Any]:
    """What the script of the page needs."""
    clearance = prediction.clearance or ClearanceSettings()
    profile = () if prediction.clearances is None else prediction.clearances.profile
    line = None
    if content.spans:
        line = line_data(content.spans, profile, clearance.step, clearance.applied(), units)
    return {
        "west": frame.west,
        "north": frame.north,
        "width": frame.width,
        "height": frame.height,
        "planar": units.planar,
        "planar_m": units.planar_m,
        "vertical": units.vertical,
        "vertical_m": units.vertical_m,
        "step_m": STEP_M,
        "towers": tower_data(content.towers, units.vertical_m),
        "line": line,
    }


def _hash(text: str) -> str:
    """What the Content-Security-Policy of the page says of a style or script that may apply."""
    digest = hashlib.sha256(text.encode("utf-8")).digest()
    return f"sha256-{base64.b64encode(digest).decode('ascii')}"
