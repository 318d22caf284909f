"""The clearances of the lines of a survey, from the points that its prediction keeps on disk."""

from __future__ import annotations

from collections import OrderedDict

import numpy as np

from scenenet.clearance.find_clearances import find_clearances
from scenenet.clearance.records import SurveyClearances
from scenenet.clearance.section import Area
from scenenet.clearance.settings import ClearanceSettings
from scenenet.line.records import SurveyLine
from scenenet.pointcloud.class_schemes import ClassScheme
from scenenet.prediction.work.structures import Owners, Structures
from scenenet.prediction.work.tiling import TileSpool

KEPT_POINTS = 4_000_000
"""Points in memory besides those of a section: neighbouring sections need the same tiles."""


def find_clearances_in_survey(
    spool: TileSpool,
    line: SurveyLine,
    structures: Structures,
    settings: ClearanceSettings,
    scheme: ClassScheme | None = None,
    progress: str | None = None,
) -> SurveyClearances:
    """What is near the conductors of a survey. Memory is bounded by a section of a span.

    Args:
        spool: the points of all its files.
        line: its lines.
        structures: the shapes of its towers; their points are no obstacles.
        scheme: of the class codes, which ``spool`` then keeps; None where the height above ground
            says what points are.
        progress: label of the progress on stderr; None shows no progress.

    Raises:
        InputError: the limits have none for the voltage.
    """
    points = _AreaPoints(spool, structures, classes=scheme is not None)
    return find_clearances(line, points, settings, scheme, progress)


class _AreaPoints:
    """Gives the points in an area that belong to no tower, with their class codes."""

    def __init__(self, spool: TileSpool, structures: Structures, *, classes: bool) -> None:
        self._spool, self._classes = spool, classes
        self._columns = spool.columns()
        self._owners = Owners(structures, spool.lattice)
        self._kept: OrderedDict[int, tuple[np.ndarray, np.ndarray | None]] = OrderedDict()

    def __call__(self, area: Area) -> tuple[np.ndarray, np.ndarray | None]:
        (west, south), (east, north) = area.box()
        places, codes = [np.empty((0, 3))], [np.empty(0, np.uint8)]
        for column in sorted(self._spool.lattice.columns((west, east), (south, north))):
            for code in self._columns.get(column, ()):
                xyz, classes = self._tile(code)
                inside = area.has(xyz)
                places.append(xyz[inside])
                if classes is not None:
                    codes.append(classes[inside])
        found = np.concatenate(places)
        return found, np.concatenate(codes) if self._classes else None

    def _tile(self, code: int) -> tuple[np.ndarray, np.ndarray | None]:
        """The points of a tile that belong to no tower. Those that were used last stay in
        memory."""
        if code not in self._kept:
            classes = None
            if self._classes:
                xyz, classes = self._spool.classified_points(code)
            else:
                xyz = self._spool.points(code)
            free = self._owners(xyz, np.full(len(xyz), code)) == 0
            self._kept[code] = xyz[free], None if classes is None else classes[free]
            while len(self._kept) > 1 and self._held() > KEPT_POINTS:
                self._kept.popitem(last=False)
        self._kept.move_to_end(code)
        return self._kept[code]

    def _held(self) -> int:
        return sum(len(xyz) for xyz, _ in self._kept.values())
