"""The points around each span, few enough for all of them to be in one page."""

from __future__ import annotations

import base64
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from scenenet.clearance.kinds import HOUSE, ON_GROUND, PLANT
from scenenet.clearance.section import Area, SectionPoints, look_around, sections
from scenenet.clearance.settings import ClearanceSettings
from scenenet.clearance.touching import AIR, on_wires
from scenenet.core.progress import track
from scenenet.line.frame import SpanFrame
from scenenet.line.records import Conductor, LineSpan
from scenenet.pointcloud.targets import WIRE as WIRES
from scenenet.prediction.area_points import FREE, TOWER, AreaLookUp, WireVoxels
from scenenet.prediction.page.budget import SPAN_POINTS, PageBudget
from scenenet.prediction.page.thinning import STEP_M, quotas, thinned

if TYPE_CHECKING:
    from scenenet.prediction.survey_prediction import SurveyPrediction

GROUND, VEGETATION, BUILDING, WIRE, OF_TOWER = PICTURED = (
    "ground", "vegetation", "building", "wire", "tower"
)  # fmt: skip
"""What the points of a picture are, in their order there."""

WEIGHTS = 0.25, 0.4, 0.1, 0.15, 0.1
"""Share of each of these in a picture that has enough points of all."""

BESIDE_M = 12.0
"""m beside the outermost conductors up to which a picture has points."""

SQUEEZED = 0.25
"""Share of distances to the side that counts where points are thinned: a profile shows what is
high or low, and not what lies side by side."""

STEPS_MOST = 32_000
"""Steps from the middle of a picture to its ends, at most."""


@dataclass(frozen=True)
class SpanPicture:
    """The points around a span.

    Attributes:
        span_id: of the span.
        steps: (n, 3) int16, along the span, to its left and up, in ``step`` from ``origin``; what
            the points are ascends as in ``PICTURED``.
        counts: how many points are each of ``PICTURED``.
        step: m.
        origin: m, along the span and elevation.
        half_width: m, to either side.
    """

    span_id: int
    steps: np.ndarray
    counts: tuple[int, ...]
    step: float
    origin: tuple[float, float]
    half_width: float

    @classmethod
    def of(
        cls, span: LineSpan, parts: Sequence[np.ndarray], half_width: float, most: int
    ) -> SpanPicture:
        """The picture of points of each of ``PICTURED``, (n, 3) m in the frame of a span, thinned
        to at most ``most``."""
        kept = quotas([len(part) for part in parts], WEIGHTS, most)
        drawn = [_thinned(part, n) for part, n in zip(parts, kept, strict=True) if n]
        stz = np.concatenate([*drawn, np.empty((0, 3))])
        low = float(np.floor(stz[:, 2].min())) if len(stz) else 0.0
        origin = round(span.length / 2, 2), low
        offsets = stz - (origin[0], 0.0, low)
        step = max(STEP_M, float(np.abs(offsets).max(initial=0.0)) / STEPS_MOST)
        counts = iter([len(part) for part in drawn])
        return cls(
            span.span_id, np.rint(offsets / step).astype("<i2"),
            tuple(next(counts) if n else 0 for n in kept), step, origin, half_width,
        )  # fmt: skip

    def packed(self) -> str:
        """``steps`` as base64: little-endian, point by point."""
        return base64.b64encode(self.steps.tobytes()).decode("ascii")


def span_pictures(
    prediction: SurveyPrediction, spans: Sequence[LineSpan], budget: PageBudget
) -> Iterator[SpanPicture]:
    """Pictures of spans of a prediction, in their order. Memory is that of a section of one.

    Points are ground, vegetation or building as the clearances have it.
    """
    line = prediction.line
    if line is None:
        return
    wires = next(each for each in prediction.further if each.used.target.name == WIRES)
    points = AreaLookUp(prediction.spool, prediction.structures, WireVoxels(wires.search))
    settings = prediction.clearance or ClearanceSettings()
    of_span: dict[int, list[Conductor]] = defaultdict(list)
    for conductor in line.conductors:
        of_span[conductor.span_id].append(conductor)
    most = budget.points(SPAN_POINTS)
    for span in track(spans, "pictures of spans", total=len(spans)):
        own = of_span[span.span_id]
        frame = SpanFrame.between(np.array(span.start), np.array(span.end))
        areas = sections(frame, own, settings.reach)
        half_width = areas[0].half_width - settings.reach + BESIDE_M
        thin = []
        for area in areas:
            section = _parts(area, half_width, own, points, prediction, settings.few_points)
            thin.append([_thinned(frame.to_frame(part), 2 * most) for part in section])
        parts = [np.concatenate(each) for each in zip(*thin, strict=True)]
        yield SpanPicture.of(span, parts, half_width, most)


def _parts(
    area: Area,
    half_width: float,
    own: Sequence[Conductor],
    points: AreaLookUp,
    prediction: SurveyPrediction,
    few_points: int,
) -> list[np.ndarray]:
    """The points (n, 3) m in a section that are each of ``PICTURED``."""
    narrow = Area(area.frame, area.first, area.last, half_width)
    looked_at = []

    def free_points(wide: Area) -> SectionPoints:
        """The points around the section that belong to nothing; they are looked up once."""
        found = points.all(wide)
        looked_at.append(found.at(narrow.has(found.xyz)))
        free = found.at(found.part == FREE)
        return SectionPoints(free.xyz, free.codes)

    around = look_around(area, own, free_points, prediction.scheme, few_points)
    [everything] = looked_at
    inside = narrow.has(around.xyz)
    xyz, kind = np.compress(inside, around.xyz, axis=0), around.kind[inside]
    free = everything.part == FREE
    of_tower = everything.part == TOWER
    wire = ~free & ~of_tower
    wire[free] = on_wires(everything.xyz[free], own) > AIR
    return [
        *(np.compress(kind == number, xyz, axis=0) for number in (ON_GROUND, PLANT, HOUSE)),
        everything.xyz[wire],
        everything.xyz[of_tower],
    ]


def _thinned(stz: np.ndarray, most: int) -> np.ndarray:
    """At most ``most`` of the points (n, 3) m in the frame of a span."""
    squeezed = np.array([1.0, SQUEEZED, 1.0])
    return thinned(stz * squeezed, most) / squeezed
