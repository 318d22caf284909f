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
from scenenet.prediction.work.tile_predictions import TilePredictions
from scenenet.prediction.work.tiling import TileSpool, groups

KEPT_POINTS = 4_000_000
"""Points in memory besides those of a section: neighbouring sections need the same tiles."""


def find_clearances_in_survey(
    spool: TileSpool,
    line: SurveyLine,
    structures: Structures,
    wires: WireVoxels,
    settings: ClearanceSettings,
    scheme: ClassScheme | None = None,
    progress: str | None = None,
) -> SurveyClearances:
    """What is near the conductors of a survey. Memory is bounded by a section of a span.

    Args:
        spool: the points of all its files.
        line: its lines.
        structures: the shapes of its towers; their points are no obstacles.
        wires: where the model of wires found them; their points are no obstacles either, because
            some belong to conductors that were not traced.
        scheme: of the class codes, which ``spool`` then keeps; None where the height above ground
            says what points are.
        progress: label of the progress on stderr; None shows no progress.

    Raises:
        InputError: the limits have none for the voltage.
    """
    points = _AreaPoints(spool, structures, wires, classes=scheme is not None)
    return find_clearances(line, points, settings, scheme, progress)


class WireVoxels:
    """The voxels that a model of wires is certain of."""

    def __init__(self, spool: TileSpool, predictions: TilePredictions, tau: float) -> None:
        """Read the predictions.

        Args:
            spool: the voxels that the model observes.
            predictions: of the model, for all its tiles.
            tau: of the model.
        """
        self._lattice = spool.lattice
        self._sure: dict[int, np.ndarray] = {}
        for code, _ in spool.places():
            prediction = predictions.read(code)
            sure = prediction.probability >= tau
            if sure.any():
                self._sure[code] = prediction.voxel[sure]

    def have(self, xyz: np.ndarray) -> np.ndarray:
        """(n,) bool: which points (n, 3) m are in them."""
        inside = np.zeros(len(xyz), bool)
        codes, voxels = self._lattice.locate(xyz)
        for code, rows in groups(codes):
            if code in self._sure:
                inside[rows] = np.isin(voxels[rows], self._sure[code])
        return inside


class _AreaPoints:
    """Gives the points in an area that belong to no tower or wire, with their class codes."""

    def __init__(
        self, spool: TileSpool, structures: Structures, wires: WireVoxels, *, classes: bool
    ) -> None:
        self._spool, self._wires, self._classes = spool, wires, classes
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
        """The points of a tile that belong to no tower or wire. Those that were used last stay in
        memory."""
        if code not in self._kept:
            classes = None
            if self._classes:
                xyz, classes = self._spool.classified_points(code)
            else:
                xyz = self._spool.points(code)
            free = self._owners(xyz, np.full(len(xyz), code)) == 0
            free &= ~self._wires.have(xyz)
            self._kept[code] = xyz[free], None if classes is None else classes[free]
            while len(self._kept) > 1 and self._held() > KEPT_POINTS:
                self._kept.popitem(last=False)
        self._kept.move_to_end(code)
        return self._kept[code]

    def _held(self) -> int:
        return sum(len(xyz) for xyz, _ in self._kept.values())
