"""What the map of a survey shows, as SVG."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from scenenet.detection.survey_tower import SurveyTower
from scenenet.prediction.file_status import SurveyFile
from scenenet.prediction.tower_lists import coverage

if TYPE_CHECKING:
    from scenenet.prediction.survey_prediction import SurveyPrediction

MOST_CORNERS = 20_000
"""Most corners of the outline of the coverage; a longer survey has a simpler outline."""

BEARING_M = 25.0
"""m, length of the strokes that show where conductors leave a tower."""


@dataclass(frozen=True)
class MapFrame:
    """The part of the plane that a map shows.

    SVG has y downwards and single precision, so its coordinates count from the north-west corner.

    Attributes:
        west, north: x and y of the corner, in the units of the survey.
        width, height: in the same units.
    """

    west: float
    north: float
    width: float
    height: float

    @classmethod
    def around(cls, boxes: Iterable[Sequence[float]]) -> MapFrame:
        """The smallest frame in whole units around boxes (x, y, x, y), of which some may be NaN."""
        corners = np.array([box for box in boxes if np.isfinite(box).all()]).reshape(-1, 4)
        if not len(corners):
            return cls(0.0, 1.0, 1.0, 1.0)
        west, south = np.floor(corners[:, :2].min(axis=0)).tolist()
        east, north = np.ceil(corners[:, 2:].max(axis=0)).tolist()
        return cls(west, north, max(east - west, 1.0), max(north - south, 1.0))

    def place(self, x: float, y: float) -> str:
        """A place as text, in the coordinates of the map."""
        return f"{x - self.west:.2f} {self.north - y:.2f}"

    def ring(self, xy: np.ndarray) -> str:
        """A closed ring (n, 2) as path data."""
        return "M" + "L".join(self.place(*corner) for corner in xy[:-1].tolist()) + "Z"


def frame_and_shapes(prediction: SurveyPrediction, doubtful: set[int]) -> tuple[MapFrame, str]:
    """The frame of a survey, and its coverage, files and towers as SVG elements.

    Args:
        doubtful: ids of the towers to check.
    """
    import shapely

    planar = prediction.unit_sizes[0]
    area = shapely.transform(coverage(prediction.spool), lambda xy: xy / planar)
    boxes = [file.extent for file in prediction.files if file.extent is not None]
    places = [(t.x, t.y, t.x, t.y) for t in prediction.towers]
    frame = MapFrame.around([shapely.bounds(area).tolist(), *boxes, *places])
    shapes = [
        f'<path class="coverage" d="{_outline(area, frame)}"/>',
        *(_file(file, frame) for file in prediction.files if file.extent is not None),
        f'<path class="bearings" d="{_bearings(prediction.towers, frame, planar)}"/>',
        *(_marker(tower, tower.id in doubtful, frame) for tower in prediction.towers),
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
