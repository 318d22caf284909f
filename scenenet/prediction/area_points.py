"""The points of a survey in an area beside its lines, and what they belong to."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass

import numpy as np

from scenenet.clearance.section import Area, SectionPoints
from scenenet.prediction.found_line import WireSearch
from scenenet.prediction.work.lattice import groups
from scenenet.prediction.work.structures import Owners, Structures
from scenenet.prediction.work.tiling import LOW_POINT, TileSpool

KEPT_POINTS = 4_000_000
"""Points in memory besides those of a section: neighbouring sections need the same tiles."""

JUMPER_M = 3.0
"""m beyond the reach of a tower in which points in voxels of wires are its jumpers and strings."""

FREE, TOWER, WIRE, NOISE = 0, 1, 2, 3
"""What a point belongs to: nothing, the structure of a tower, a voxel of a wire, or noise."""


class WireVoxels:
    """The voxels that a model of wires is certain of."""

    def __init__(self, wires: WireSearch) -> None:
        """Read the predictions."""
        self._lattice = wires.spool.lattice
        self._sure: dict[int, np.ndarray] = {}
        for code, _ in wires.spool.places():
            prediction = wires.predictions.read(code)
            sure = prediction.probability >= wires.tau
            if sure.any():
                self._sure[code] = prediction.voxel[sure]

    def have(self, xyz: np.ndarray) -> np.ndarray:
        """(n,) bool: which points (n, 3) m are in them."""
        inside = np.zeros(len(xyz), bool)
        codes, voxels = self._lattice.locate(xyz)
        for code, rows in groups(codes):
            if code in self._sure:
                sure, own = self._sure[code], voxels[rows]
                inside[rows] = sure[np.minimum(np.searchsorted(sure, own), len(sure) - 1)] == own
        return inside


@dataclass(frozen=True)
class AreaPoints:
    """Points.

    Attributes:
        xyz: (n, 3) m.
        part: (n,) uint8, one of ``FREE``, ``TOWER``, ``WIRE`` and ``NOISE``.
        codes: (n,) uint8 class codes; None where they are not known.
    """

    xyz: np.ndarray
    part: np.ndarray
    codes: np.ndarray | None

    def at(self, mask: np.ndarray) -> AreaPoints:
        """Those of a mask (n,)."""
        codes = None if self.codes is None else self.codes[mask]
        # ``xyz[mask]`` gives the same in three times the time.
        return AreaPoints(np.compress(mask, self.xyz, axis=0), self.part[mask], codes)


class AreaLookUp:
    """Gives the points of a survey in an area. Tiles that were used last stay in memory."""

    def __init__(self, spool: TileSpool, structures: Structures, wires: WireVoxels) -> None:
        """Start with no tile in memory.

        Args:
            spool: the points of all files of the survey.
            structures: the shapes of its towers.
            wires: where the model of wires found them.
        """
        self._spool, self._wires, self._classes = spool, wires, spool.classified
        self._columns = spool.columns()
        self._owners = Owners(structures, spool.lattice)
        shapes = [shape for _, shape in structures.numbered]
        self._axes = np.array([(shape.x, shape.y) for shape in shapes]).reshape(-1, 2)
        self._reach = np.array([shape.reach for shape in shapes]) + JUMPER_M
        self._kept: OrderedDict[int, AreaPoints] = OrderedDict()

    def all(self, area: Area) -> AreaPoints:
        """All points in an area, in a fixed order."""
        (west, south), (east, north) = area.box()
        parts = [AreaPoints(np.empty((0, 3)), np.empty(0, np.uint8), np.empty(0, np.uint8))]
        for column in sorted(self._spool.lattice.columns((west, east), (south, north))):
            for code in self._columns.get(column, ()):
                tile = self._tile(code)
                parts.append(tile.at(area.has(tile.xyz)))
        codes = [part.codes for part in parts if part.codes is not None]
        return AreaPoints(
            np.concatenate([part.xyz for part in parts]),
            np.concatenate([part.part for part in parts]),
            np.concatenate(codes) if self._classes else None,
        )

    def obstacles(self, area: Area) -> SectionPoints:
        """The points in an area that belong to no tower, nor to its jumpers and strings, and are no
        noise."""
        found = self.all(area)
        free = (found.part != TOWER) & (found.part != NOISE)
        wire = np.flatnonzero(found.part == WIRE)
        free[wire] = ~self._at_tower(found.xyz[wire])
        found = found.at(free)
        return SectionPoints(found.xyz, found.codes, found.part == WIRE)

    def _at_tower(self, xyz: np.ndarray) -> np.ndarray:
        """(n,) bool: which points (n, 3) m may be on a jumper or a string."""
        from scipy.spatial import cKDTree

        if not len(self._axes):
            return np.zeros(len(xyz), bool)
        away, tower = cKDTree(self._axes).query(xyz[:, :2])
        return np.asarray(away <= self._reach[tower])

    def _tile(self, code: int) -> AreaPoints:
        if code not in self._kept:
            codes = None
            if self._classes:
                xyz, codes = self._spool.classified_points(code)
            else:
                xyz = self._spool.points(code)
            part = np.full(len(xyz), FREE, np.uint8)
            part[self._wires.have(xyz)] = WIRE
            part[self._owners(xyz, np.full(len(xyz), code)) > 0] = TOWER
            if codes is not None:
                part[codes == LOW_POINT] = NOISE
            self._kept[code] = AreaPoints(xyz, part, codes)
            while len(self._kept) > 1 and self._held() > KEPT_POINTS:
                self._kept.popitem(last=False)
        self._kept.move_to_end(code)
        return self._kept[code]

    def _held(self) -> int:
        return sum(len(tile.xyz) for tile in self._kept.values())
