"""What the map of a survey shows, as SVG."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from scenenet.detection.survey_tower import SurveyTower
from scenenet.prediction.file_status import SurveyFile
from scenenet.prediction.page.frame import MapFrame
from scenenet.prediction.page.line_shapes import line_shapes
from scenenet.prediction.page.span_facts import SpanFacts
from scenenet.prediction.page.survey_facts import shown_files
from scenenet.prediction.tower_lists import coverage

if TYPE_CHECKING:
    from scenenet.prediction.survey_prediction import SurveyPrediction

MOST_CORNERS = 20_000
"""Most corners of the outline of the coverage; a longer survey has a simpler outline."""

BEARING_M = 25.0
"""m, length of the strokes that show where conductors leave a tower."""


def frame_and_shapes(
    prediction: SurveyPrediction, doubtful: Mapping[int, bool], spans: Sequence[SpanFacts]
) -> tuple[MapFrame, str]:
    """The frame of a survey, and its coverage, files, line and towers as SVG elements.

    Args:
        doubtful: ids of the towers that the page lists -> whether they are to check.
        spans: that the page lists.
    """
    import shapely

    planar = prediction.unit_sizes[0]
    area = shapely.transform(coverage(prediction.spool), lambda xy: xy / planar)
    files = [file for file in shown_files(prediction.files) if file.extent is not None]
    boxes = [file.extent for file in files if file.extent is not None]
    places = [(t.x, t.y, t.x, t.y) for t in prediction.towers]
    line = prediction.line
    ends = () if line is None else (end for span in line.spans for end in (span.start, span.end))
    places += [(x / planar, y / planar, x / planar, y / planar) for x, y in ends]
    frame = MapFrame.around([shapely.bounds(area).tolist(), *boxes, *places])
    of_line = []
    if line is not None:
        of_line = line_shapes(line, spans, prediction.clearances, frame, planar)
    listed = [tower for tower in prediction.towers if tower.id in doubtful]
    others = [tower for tower in prediction.towers if tower.id not in doubtful]
    shapes = [
        f'<path class="coverage" d="{_outline(area, frame)}"/>',
        *(_file(file, frame) for file in files),
        f'<path class="bearings" d="{_bearings(listed, frame, planar)}"/>',
        *of_line,
        f'<path class="unlisted" d="{_dots(others, frame)}"/>' if others else "",
        *(_marker(tower, doubtful[tower.id], frame) for tower in listed),
    ]
    return frame, "\n".join(shapes)


def _outline(area: Any, frame: MapFrame) -> str:
    import shapely

    tolerance = max(frame.width, frame.height) / 4000
    while shapely.get_num_coordinates(area) > MOST_CORNERS:
        area = shapely.simplify(area, tolerance)
        tolerance *= 2
    rings = shapely.get_rings(shapely.get_parts(area))
    return "".join(frame.ring(shapely.get_coordinates(ring)) for ring in rings)


def _file(file: SurveyFile, frame: MapFrame) -> str:
    west, south, east, north = file.extent or (0.0, 0.0, 0.0, 0.0)
    corners = np.array([
        (west, south), (east, south), (east, north), (west, north), (west, south),
    ])  # fmt: skip
    kind = "file" if file.error is None else "file unused"
    title = escape(f"{file.name}: {file.status}")
    return f'<path class="{kind}" d="{frame.ring(corners)}"><title>{title}</title></path>'


def _bearings(towers: Iterable[SurveyTower], frame: MapFrame, planar: float) -> str:
    strokes = []
    for tower in towers:
        for bearing in np.radians(tower.conductor_bearings):
            x = tower.x + BEARING_M / planar * float(np.sin(bearing))
            y = tower.y + BEARING_M / planar * float(np.cos(bearing))
            strokes.append(f"M{frame.place(tower.x, tower.y)}L{frame.place(x, y)}")
    return "".join(strokes)


def _marker(tower: SurveyTower, doubtful: bool, frame: MapFrame) -> str:
    """A stroke without length: its cap is a disc or a square that does not grow with the map."""
    kind = "tower check" if doubtful else "tower"
    place = frame.place(tower.x, tower.y)
    return f'<path class="{kind}" data-tower="{tower.id}" d="M{place}h0"/>'


def _dots(towers: Iterable[SurveyTower], frame: MapFrame) -> str:
    return "".join(f"M{frame.place(tower.x, tower.y)}h0" for tower in towers)
