"""What the points around a line are: ground, vegetation or building."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numba
import numpy as np

from scenenet.clearance.ground_model import GroundModel
from scenenet.core.compilation import EXACT
from scenenet.core.extent import extent
from scenenet.pointcloud.class_schemes import ClassScheme, Role

NO_OBSTACLE, ON_GROUND, PLANT, HOUSE = -1, 0, 1, 2
"""Kinds of points; those from 0 are numbers in ``scenenet.clearance.settings.KINDS``."""

BY_HEIGHT = 127
"""The kind of a class code of whose points the height above ground says what they are."""

BAND_M, BAND_SLOPE = 0.3, 0.35
"""m above the ground up to which a point is on it: on level ground, and more for each unit of
slope."""

BELOW_M = 2.0
"""m below the ground from which a point is a stray return."""

COLUMN_M, GAP_M, GAP = 5.0, 20.0, 0.6
"""m, edge of columns; points in one above a gap of this many m, and of this share of their height,
are in the air: birds, clouds, and wires that were not found. The jib of a crane is not: it hangs
together with a mast."""

MIN_GROUND = 50
"""Points with a class of ground from which the ground model is made of them."""


CUBE_M = 1.0
"""m, edge of the cubes in which a point has others around it: in its own and the next ones."""

SPARSE = 0.5
"""Share of lone points from which they show how few points the survey has, not what they are."""


@dataclass(frozen=True)
class Surroundings:
    """Points around a section of a line.

    Attributes:
        xyz: (n, 3) m.
        kind: (n,) int8, number of the kind, or ``NO_OBSTACLE``.
        height: (n,) m above the ground.
        ground: below them.
        few: a point with fewer of its kind around it, itself among them, is a lone one.
    """

    xyz: np.ndarray
    kind: np.ndarray
    height: np.ndarray
    ground: GroundModel
    few: int

    @cached_property
    def lone(self) -> np.ndarray:
        """(n,) bool, which have few of their kind around them."""
        return lone_points(self.xyz, self.kind, self.few)


KIND_OF_ROLE: Mapping[Role, int] = {
    "vegetation": PLANT, "building": HOUSE, "tower": NO_OBSTACLE, "conductor": NO_OBSTACLE,
    "fitting": NO_OBSTACLE, "noise": NO_OBSTACLE,
}  # fmt: skip
"""Role of a class -> kind of its points; for the ground the scheme says which classes it is."""


def kinds_from(scheme: ClassScheme | None) -> str:
    """Where the kinds of points are from, as every output says it."""
    if scheme is None:
        return "from height above ground; vegetation includes buildings and other objects"
    return f"from classes {scheme.name}; without a class, from height above ground"


def kind_table(scheme: ClassScheme) -> np.ndarray:
    """(256,) int8, the kind of each class code; ``BY_HEIGHT`` where that decides."""
    table = np.full(256, BY_HEIGHT, np.int8)
    table[scheme.is_ground(np.arange(256))] = ON_GROUND
    for role, kind in KIND_OF_ROLE.items():
        table[list(scheme.with_role(role))] = kind
    return table


def surroundings(
    xyz: np.ndarray, codes: np.ndarray | None, scheme: ClassScheme | None, few: int
) -> Surroundings:
    """The kinds of points (n, 3) m, of which none belongs to a line.

    Args:
        codes: (n,) uint8 class codes; None where only the heights decide.
        scheme: of the codes.
        few: of ``Surroundings``.
    """
    known = np.full(len(xyz), BY_HEIGHT, np.int8)
    if scheme is not None and codes is not None:
        known = kind_table(scheme)[codes]
        kept = known != NO_OBSTACLE
        xyz, known = xyz[kept], known[kept]
    if not len(xyz):
        flat = GroundModel(np.zeros(2), np.zeros((2, 2)), np.zeros((2, 2)))
        return Surroundings(xyz, known, np.empty(0), flat, few)
    box = np.array(extent(xyz[:, :2]))
    on_ground = known == ON_GROUND
    if on_ground.sum() >= MIN_GROUND:
        ground = GroundModel.from_ground(xyz[on_ground], box)
    else:
        ground = GroundModel.from_points(xyz, box)
    height = xyz[:, 2] - ground.height(xyz[:, :2])
    band = BAND_M + BAND_SLOPE * ground.slope(xyz[:, :2])
    by_height = np.where(height <= band, ON_GROUND, PLANT)
    by_height[(height < -BELOW_M) | _in_the_air(xyz, height)] = NO_OBSTACLE
    kind = np.where(known == BY_HEIGHT, by_height, known).astype(np.int8)
    return Surroundings(xyz, kind, height, ground, few)


def _in_the_air(xyz: np.ndarray, height: np.ndarray) -> np.ndarray:
    """(n,) bool: which points (n, 3) m, at heights (n,) m above ground, nothing holds."""
    above = above_gap(xyz[:, :2], height)
    if above.any():
        rows = np.flatnonzero(height >= height[above].min() - CUBE_M)
        above[rows] = ~_held(xyz[rows], ~above[rows])
    return above


def _held(xyz: np.ndarray, standing: np.ndarray) -> np.ndarray:
    """(n,) bool: which points (n, 3) m hang together with one that is ``standing`` (n,), cube by
    cube."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    cubes, cube = np.unique(np.floor(xyz / CUBE_M), axis=0, return_inverse=True)
    cube = cube.ravel()
    pairs = cKDTree(cubes).query_pairs(1.0, p=np.inf, output_type="ndarray")
    links = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(cubes),) * 2)
    n, part = connected_components(links, directed=False)
    stands = np.zeros(n, bool)
    stands[part[cube[standing]]] = True
    return stands[part[cube]]


def above_gap(xy: np.ndarray, height: np.ndarray) -> np.ndarray:
    """(n,) bool: which points at places (n, 2) m and heights (n,) m above ground have nothing below
    them."""
    found = np.zeros(len(height), bool)
    if not (height > GAP_M).any():
        return found
    column, ends = _ends_of_gaps(xy, height, COLUMN_M, GAP_M)
    rows = np.flatnonzero(ends)
    order = rows[np.lexsort((height[rows], column[rows]))]
    column, height = column[order], height[order]
    below = np.concatenate(([0.0], height[:-1]))
    starts = np.concatenate(([True], column[1:] != column[:-1]))
    below[starts] = 0.0
    gaps = np.cumsum(height - below > np.maximum(GAP_M, GAP * height))
    before = np.concatenate(([0], gaps[:-1]))
    first = np.maximum.accumulate(np.where(starts, np.arange(len(gaps)), 0))
    found[order] = gaps > before[first]
    return found


@numba.njit(**EXACT)
def _ends_of_gaps(xy, height, edge, gap):  # pragma: no cover - compiled
    """Number (n,) of the column of each point, and (n,) bool: points among which all gaps of
    columns with a point above ``gap`` m are.

    A gap that ends below that begins below the ground. None does where a point is close above the
    ground and none is far below it: the highest of the low points stands for all of them.

    Args:
        xy: (n, 2) m, places of the points.
        height: (n,) m above the ground.
        edge: m, of a column.
    """
    east, north = np.empty(len(xy), np.int64), np.empty(len(xy), np.int64)
    for i in range(len(xy)):
        east[i], north[i] = np.int64(np.floor(xy[i, 0] / edge)), np.int64(np.floor(xy[i, 1] / edge))
    west, south = east.min(), north.min()
    columns = north.max() - south + 1
    column = (east - west) * columns + (north - south)
    n = (east.max() - west + 1) * columns
    high, close, deep = np.zeros(n, np.bool_), np.zeros(n, np.bool_), np.zeros(n, np.bool_)
    highest = np.full(n, -np.inf)
    for i in range(len(xy)):
        at = column[i]
        if height[i] > gap:
            high[at] = True
        else:
            highest[at] = max(highest[at], height[i])
            close[at] |= 0 <= height[i] < gap / 2
            deep[at] |= height[i] < -gap / 2
    ends = np.empty(len(xy), np.bool_)
    for i in range(len(xy)):
        at = column[i]
        below = height[i] <= gap and close[at] and not deep[at] and height[i] < highest[at]
        ends[i] = high[at] and not below
    return column, ends


def lone_points(xyz: np.ndarray, kind: np.ndarray, few: int) -> np.ndarray:
    """(n,) bool: which points (n, 3) m of kinds (n,) have fewer than ``few`` of their kind in the
    cubes around them; none of a kind that is sparse altogether, and none on the ground.

    They are mostly returns from the air, from birds or dust.
    """
    lone = np.zeros(len(xyz), bool)
    for number in (PLANT, HOUSE):
        rows = np.flatnonzero(kind == number)
        if not len(rows):
            continue
        at = np.floor(xyz[rows] / CUBE_M).astype(np.int64)
        low, high = extent(at)
        at -= low - 1
        size = high - low + 3
        flat = (at[:, 0] * size[1] + at[:, 1]) * size[2] + at[:, 2]
        cubes, cube, count = np.unique(flat, return_inverse=True, return_counts=True)
        few_around = _around(cubes, count, size[1], size[2])[cube] < few
        if few_around.mean() <= SPARSE:
            lone[rows] = few_around
    return lone


@numba.njit(**EXACT)
def _around(cubes, count, columns, levels):  # pragma: no cover - compiled
    """Number of points in each cube and the 26 around it.

    Args:
        cubes: (C,) flat numbers of the cubes that have points, ascending.
        count: (C,) points in each.
        columns, levels: cubes along y and z, with an empty one at each end.
    """
    total = np.zeros(len(cubes), np.int64)
    for x in range(-1, 2):
        for y in range(-1, 2):
            # Those of the next column follow one another, as the cubes do: two ends move along.
            first = past = 0
            within = np.int64(0)
            for i in range(len(cubes)):
                other = cubes[i] + (x * columns + y) * levels
                while past < len(cubes) and cubes[past] <= other + 1:
                    within += count[past]
                    past += 1
                while first < past and cubes[first] < other - 1:
                    within -= count[first]
                    first += 1
                total[i] += within
    return total
