"""The lattice of voxels that all surveys are on, and its tiles.

Voxel (i, j, k) covers [i, i + 1) * voxel_size in map coordinates. A tile has ``EDGE`` voxels along
each edge, and a code that sorts by z, then y, then x.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import product

import numba
import numpy as np

from scenenet.core.compilation import EXACT
from scenenet.core.errors import InputError
from scenenet.dataset.voxels import BORDER_M

EDGE = 64
"""Voxels along the edge of a tile; a tile and its halo fit into a processor's cache."""

_BITS = 21
_BIAS = 1 << (_BITS - 1)


@dataclass(frozen=True)
class Lattice:
    """The lattice of voxels that all surveys are on.

    Attributes:
        voxel_size: m.
    """

    voxel_size: float

    def locate(self, xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Tile code (n,) int64 and position in the tile (n,) int32 of points (n, 3) m.

        Raises:
            InputError: a coordinate is outside the lattice.
        """
        codes, voxels, n = _located(np.asarray(xyz, float), self.voxel_size, BORDER_M)
        if n < len(xyz):
            raise InputError(
                f"the point {xyz[n].tolist()} is too far from the origin for voxels of "
                f"{self.voxel_size:g} m",
                remedy="Remove stray points, or convert the survey to metres",
            )
        return codes, voxels

    def centres(self, zyx: np.ndarray) -> np.ndarray:
        """(M, 3) xyz, m, centres of the voxels (M, 3) on the lattice."""
        centres = zyx[:, ::-1] + 0.5
        centres *= self.voxel_size
        return centres

    def corner(self, code: int) -> np.ndarray:
        """(3,) m, lowest x, y and z of a tile."""
        return np.array(place_of(code)[::-1]) * (EDGE * self.voxel_size)

    def columns(self, x: tuple[float, float], y: tuple[float, float]) -> set[tuple[int, int]]:
        """(x, y) numbers of the columns of tiles that the rectangle of two ranges in m touches."""
        edge = EDGE * self.voxel_size
        (west, east), (south, north) = (
            (int(np.floor((low - BORDER_M) / edge)), int(np.floor((high + 2 * BORDER_M) / edge)))
            for low, high in (x, y)
        )
        return set(product(range(west, east + 1), range(south, north + 1)))


@numba.njit(**EXACT)
def _located(xyz, voxel_size, border):  # pragma: no cover - compiled
    """Tile code (n,) and position in the tile (n,) of points (n, 3), and how many were located
    before the first one that is outside the lattice."""
    codes, voxels = np.empty(len(xyz), np.int64), np.empty(len(xyz), np.int32)
    most = float(_BIAS * EDGE)
    for i in range(len(xyz)):
        x = np.floor((xyz[i, 0] + border) / voxel_size)
        y = np.floor((xyz[i, 1] + border) / voxel_size)
        z = np.floor((xyz[i, 2] + border) / voxel_size)
        if not (abs(x) < most and abs(y) < most and abs(z) < most):
            return codes, voxels, i
        a, b, c = np.int64(z), np.int64(y), np.int64(x)
        voxels[i] = ((a & (EDGE - 1)) * EDGE + (b & (EDGE - 1))) * EDGE + (c & (EDGE - 1))
        code = (((a >> 6) + _BIAS) << (2 * _BITS)) | (((b >> 6) + _BIAS) << _BITS)
        codes[i] = code | ((c >> 6) + _BIAS)
    return codes, voxels, len(xyz)


def code_of(place: tuple[int, int, int]) -> int:
    """The code of the tile at ``place`` (z, y, x)."""
    return int(codes_of(*np.asarray(place)))


def by_column(code: int) -> tuple[int, int, int]:
    """(y, x, z) of the tile with ``code``: the order in which the neighbours of a tile come soon
    after it."""
    z, y, x = place_of(code)
    return y, x, z


def column_of(code: int) -> tuple[int, int]:
    """(x, y) number of the column of tiles that has the tile with ``code``."""
    _, y, x = place_of(code)
    return x, y


def groups(codes: np.ndarray) -> Iterable[tuple[int, np.ndarray]]:
    """Each distinct code in ``codes`` (n,), with its rows."""
    if not len(codes):
        return
    # Neighbours in a file are mostly in one tile: runs of equal codes are sorted, not all points.
    starts = np.flatnonzero(np.concatenate(([True], codes[1:] != codes[:-1])))
    lengths = np.diff(starts, append=len(codes))
    runs = np.argsort(codes[starts], kind="stable")
    starts, lengths = starts[runs], lengths[runs]
    ends = np.cumsum(lengths)
    order = np.arange(len(codes)) + np.repeat(starts - (ends - lengths), lengths)
    own = codes[starts]
    for rows in np.split(order, ends[:-1][own[1:] != own[:-1]]):
        yield int(codes[rows[0]]), rows


def codes_of(z: np.ndarray, y: np.ndarray, x: np.ndarray) -> np.ndarray:
    """The codes (n,) of the tiles at places z, y, x, each (n,)."""
    return ((z + _BIAS) << (2 * _BITS)) | ((y + _BIAS) << _BITS) | (x + _BIAS)


def place_of(code: int) -> tuple[int, int, int]:
    """(z, y, x) of the tile with ``code``."""
    mask = (1 << _BITS) - 1
    return (
        (code >> (2 * _BITS)) - _BIAS,
        ((code >> _BITS) & mask) - _BIAS,
        (code & mask) - _BIAS,
    )


def on_lattice(place: tuple[int, int, int], voxel: np.ndarray) -> np.ndarray:
    """(M, 3) int64 zyx on the lattice of the voxels (M,) of the tile at ``place`` (z, y, x)."""
    local = np.stack(np.unravel_index(voxel, (EDGE,) * 3), axis=1)
    return local + np.asarray(place, np.int64) * EDGE
