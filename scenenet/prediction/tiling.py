"""A survey as tiles of voxels on disk, so that memory does not limit its length.

The voxels of all surveys are on one lattice: voxel (i, j, k) covers [i, i + 1) * voxel_size in map
coordinates. The prediction of a tile is therefore the same wherever a survey is cut.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np

from scenenet.core.errors import InputError
from scenenet.dataset.voxels import BORDER_M

EDGE = 64
"""Voxels along the edge of a tile; a tile and its halo fit into a processor's cache."""

NEIGHBOURS = np.array(list(product((-1, 0, 1), repeat=3)))
"""(27, 3) steps (z, y, x) from a tile to itself and to the tiles around it."""

_BITS = 21
_BIAS = 1 << (_BITS - 1)
_SPOOLED = np.dtype([("voxel", "<i4"), ("count", "<i4")])


@dataclass(frozen=True)
class Tile:
    """The occupied voxels of one tile.

    Attributes:
        place: (z, y, x) number of the tile.
        voxel: (M,) int32 flat C-order [z, y, x] positions within the tile, ascending.
        count: (M,) int32 number of points in each voxel.
    """

    place: tuple[int, int, int]
    voxel: np.ndarray
    count: np.ndarray

    def zyx(self) -> np.ndarray:
        """(M, 3) int64 positions on the lattice."""
        local = np.stack(np.unravel_index(self.voxel, (EDGE,) * 3), axis=1)
        return local + np.asarray(self.place, np.int64) * EDGE


class TileSpool:
    """The occupied voxels and the points of a survey, two files per tile."""

    def __init__(self, folder: Path, voxel_size: float) -> None:
        """Start an empty spool.

        Args:
            folder: existing folder for the tiles.
            voxel_size: m.
        """
        self.folder = folder
        self.voxel_size = voxel_size
        self._codes: set[int] = set()

    def add(self, xyz: np.ndarray) -> None:
        """Add points (n, 3) m to their tiles.

        Raises:
            InputError: a coordinate is outside the lattice.
        """
        codes, voxels = self.locate(xyz)
        for code, rows in groups(codes):
            voxel, count = np.unique(voxels[rows], return_counts=True)
            records = np.empty(len(voxel), _SPOOLED)
            records["voxel"], records["count"] = voxel, count
            with self._path(code).open("ab") as stream:
                stream.write(records.tobytes())
            offset = xyz[rows] - self._corner(code)
            with self._path(code, "points").open("ab") as stream:
                stream.write(offset.astype(np.float32).tobytes())
            self._codes.add(code)

    def locate(self, xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Tile code (n,) int64 and position in the tile (n,) int32 of points (n, 3) m.

        Raises:
            InputError: a coordinate is outside the lattice.
        """
        steps = np.floor((xyz[:, ::-1] + BORDER_M) / self.voxel_size)
        if not (np.abs(steps) < _BIAS * EDGE).all():
            row = int(np.argmax(~(np.abs(steps) < _BIAS * EDGE).all(axis=1)))
            raise InputError(
                f"the point {xyz[row].tolist()} is too far from the origin for voxels of "
                f"{self.voxel_size:g} m",
                remedy="Remove stray points, or convert the survey to metres",
            )
        steps = steps.astype(np.int64)
        places = steps >> 6
        local = steps & (EDGE - 1)
        voxel = (local[:, 0] * EDGE + local[:, 1]) * EDGE + local[:, 2]
        return _encode(places), voxel.astype(np.int32)

    def tiles(self) -> Iterator[Tile]:
        """Every tile that holds a point, in a fixed order."""
        for code in sorted(self._codes):
            yield self.tile(code)

    def __len__(self) -> int:
        return len(self._codes)

    def places(self) -> list[tuple[int, tuple[int, int, int]]]:
        """Code and place of every tile that holds a point, in a fixed order."""
        return [(code, _decode(code)) for code in sorted(self._codes)]

    def tile(self, code: int) -> Tile:
        """The tile with ``code``; a tile without voxels if it holds no point."""
        place = _decode(code)
        if code not in self._codes:
            return Tile(place, np.empty(0, np.int32), np.empty(0, np.int32))
        records = np.fromfile(self._path(code), _SPOOLED)
        voxel, inverse = np.unique(records["voxel"], return_inverse=True)
        count = np.bincount(inverse, weights=records["count"])
        return Tile(place, voxel, count.astype(np.int32))

    def points(self, code: int) -> np.ndarray:
        """(n, 3) m, points of the tile with ``code``, to a few micrometres, in a fixed order."""
        if code not in self._codes:
            return np.empty((0, 3))
        offset = np.fromfile(self._path(code, "points"), np.float32).reshape(-1, 3)
        return offset[np.lexsort(offset.T)] + self._corner(code)

    def around(self, place: tuple[int, int, int], reach: tuple[int, int, int]) -> Tile:
        """A tile together with its neighbours up to ``reach`` (z, y, x) voxels away.

        Returns:
            a ``Tile`` whose ``voxel`` are positions in a volume of EDGE + 2 * reach voxels, which
            includes the halo.

        Raises:
            ValueError: the reach is larger than a tile.
        """
        if max(reach) > EDGE:
            raise ValueError(f"a halo of {reach} voxels is larger than a tile of {EDGE}")
        low = np.asarray(place) * EDGE - reach
        shape = np.array([EDGE + 2 * r for r in reach])
        indices, counts = [], []
        for code in _encode(np.asarray(place) + NEIGHBOURS).tolist():
            if code not in self._codes:
                continue
            tile = self.tile(code)
            zyx = tile.zyx() - low
            inside = ((zyx >= 0) & (zyx < shape)).all(axis=1)
            indices.append(np.ravel_multi_index(tuple(zyx[inside].T), tuple(shape)))
            counts.append(tile.count[inside])
        index = np.concatenate([*indices, np.empty(0, np.int64)])
        count = np.concatenate([*counts, np.empty(0, np.int32)])
        order = np.argsort(index, kind="stable")
        return Tile(place, index[order].astype(np.int32), count[order])

    def centres(self, zyx: np.ndarray) -> np.ndarray:
        """(M, 3) xyz, m, centres of the voxels (M, 3) on the lattice."""
        return (zyx[:, ::-1] + 0.5) * self.voxel_size

    def _corner(self, code: int) -> np.ndarray:
        """(3,) m, lowest x, y and z of a tile."""
        return np.array(_decode(code)[::-1]) * (EDGE * self.voxel_size)

    def _path(self, code: int, kind: str = "voxels") -> Path:
        return self.folder / f"{code}.{kind}"


def code_of(place: tuple[int, int, int]) -> int:
    """The code of the tile at ``place`` (z, y, x)."""
    return int(_encode(np.asarray(place)[None])[0])


def groups(codes: np.ndarray) -> Iterable[tuple[int, np.ndarray]]:
    """Each distinct code in ``codes`` (n,), with its rows."""
    order = np.argsort(codes, kind="stable")
    borders = np.flatnonzero(np.diff(codes[order])) + 1
    for rows in np.split(order, borders) if len(order) else []:
        yield int(codes[rows[0]]), rows


def _encode(places: np.ndarray) -> np.ndarray:
    z, y, x = (places + _BIAS).T
    return (z << (2 * _BITS)) | (y << _BITS) | x


def _decode(code: int) -> tuple[int, int, int]:
    mask = (1 << _BITS) - 1
    return (
        (code >> (2 * _BITS)) - _BIAS,
        ((code >> _BITS) & mask) - _BIAS,
        (code & mask) - _BIAS,
    )
