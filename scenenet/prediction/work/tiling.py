"""A survey as tiles of voxels on disk, so that memory does not limit its length.

The voxels of all surveys are on one lattice (``scenenet.prediction.work.lattice``). The prediction
of a tile is therefore the same wherever a survey is cut.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from types import MappingProxyType

import numba
import numpy as np

from scenenet.core.compilation import EXACT
from scenenet.prediction.work.block_file import BlockFile, BlockWriter
from scenenet.prediction.work.lattice import EDGE, Lattice, codes_of, groups, on_lattice, place_of

KEPT_TILES = 128
"""Tiles in memory, 8 or 16 bytes a voxel: a tile and its neighbours are asked for again by the next
one."""

NEIGHBOURS = np.array(list(product((-1, 0, 1), repeat=3)))
"""(27, 3) steps (z, y, x) from a tile to itself and to the tiles around it."""

_SPOOLED = np.dtype([("voxel", "<i4"), ("count", "<i4")])
_MEASURED = np.dtype([("voxel", "<i4"), ("count", "<i4"), ("total", "<i8")])
_OFFSET = np.dtype("<f4")

SPOOLED_KINDS = VOXELS, POINTS = ("voxels", "points")
"""Blocks of each tile: its occupied voxels, and its points."""

LOW_POINT = 7
"""Class of points that the producer marked as noise, in every version of LAS and every scheme that
has it."""

CLASSES = "classes"
"""Blocks with the class codes of the points, where a later stage asks for them."""


@dataclass(frozen=True)
class Layer:
    """Voxels in which a model observes a survey.

    Attributes:
        voxel_size: m.
        measurement: what is summed up over the points of each voxel; empty where the numbers of
            points are enough.
    """

    voxel_size: float
    measurement: str = ""

    @property
    def kind(self) -> str:
        """The kind of its blocks, besides those of ``SPOOLED_KINDS``."""
        return f"{VOXELS} {self.voxel_size!r} {self.measurement}".rstrip()


def spooled_kinds(further: Iterable[Layer], *, classes: bool = False) -> tuple[str, ...]:
    """The kinds of blocks of a survey that is in ``further`` layers too, and with the class codes
    of its points if ``classes``."""
    own = (*SPOOLED_KINDS, CLASSES) if classes else SPOOLED_KINDS
    return (*own, *(layer.kind for layer in further))


@dataclass(frozen=True)
class Tile:
    """The occupied voxels of one tile.

    Attributes:
        place: (z, y, x) number of the tile.
        voxel: (M,) int32 flat C-order [z, y, x] positions within the tile, ascending.
        count: (M,) int32 number of points in each voxel.
        total: (M,) int64, the sum of ``Measurement.point_steps`` over its points; None where the
            layer has no measurement.
    """

    place: tuple[int, int, int]
    voxel: np.ndarray
    count: np.ndarray
    total: np.ndarray | None = None

    def zyx(self) -> np.ndarray:
        """(M, 3) int64 positions on the lattice."""
        return on_lattice(self.place, self.voxel)


class SpoolWriter:
    """Writes the occupied voxels and the points of a file of a survey, tile by tile."""

    def __init__(
        self, blocks: BlockWriter, lattice: Lattice, further: Iterable[Layer] = ()
    ) -> None:
        """Add points to ``blocks``, which has the kinds of ``spooled_kinds``.

        Args:
            further: further layers, for models that observe other voxels or measure other things.
        """
        self._blocks, self.lattice = blocks, lattice
        self._further = tuple(further)

    def add(
        self,
        xyz: np.ndarray,
        steps: Mapping[str, np.ndarray] = MappingProxyType({}),
        classes: np.ndarray | None = None,
    ) -> None:
        """Add points (n, 3) m to their tiles.

        Args:
            steps: (n,) what the measurement of each layer says about them, by its name.
            classes: (n,) uint8 class codes; None where they are not kept.

        Raises:
            InputError: a coordinate is outside the lattice.
        """
        for code, rows in self._add_voxels(VOXELS, self.lattice, xyz, None):
            offset = xyz[rows] - self.lattice.corner(code)
            self._blocks.add(POINTS, code, offset.astype(_OFFSET))
            if classes is not None:
                self._blocks.add(CLASSES, code, classes[rows].astype(np.uint8))
        for layer in self._further:
            lattice, values = Lattice(layer.voxel_size), steps.get(layer.measurement)
            for _ in self._add_voxels(layer.kind, lattice, xyz, values):
                pass

    def _add_voxels(
        self, kind: str, lattice: Lattice, xyz: np.ndarray, steps: np.ndarray | None
    ) -> Iterator[tuple[int, np.ndarray]]:
        """Add the voxels of points (n, 3) m; each tile, with its rows, once its voxels are added.

        Raises:
            InputError: a coordinate is outside the lattice.
        """
        codes, voxels = lattice.locate(xyz)
        for code, rows in groups(codes):
            voxel, count = np.unique(voxels[rows], return_counts=True)
            records = np.zeros(len(voxel), _SPOOLED if steps is None else _MEASURED)
            records["voxel"], records["count"] = voxel, count
            if steps is not None:
                np.add.at(records["total"], np.searchsorted(voxel, voxels[rows]), steps[rows])
            self._blocks.add(kind, code, records)
            yield code, rows


class TileSpool:
    """The occupied voxels and the points of a survey, in one file of blocks or in several.

    Attributes:
        lattice: of the voxels.
        kind: of their blocks.
        classified: whether the files keep the class codes of the points.
    """

    def __init__(
        self, lattice: Lattice, files: Iterable[BlockFile], further: Layer | None = None
    ) -> None:
        """Look at the files.

        Args:
            files: written by ``SpoolWriter`` on the same lattice. Their order does not matter.
            further: the layer with the voxels, on the same lattice; None for those that come with
                points.
        """
        self.lattice = lattice
        self.kind = VOXELS if further is None else further.kind
        self._measured = further is not None and bool(further.measurement)
        self._files: dict[int, list[BlockFile]] = defaultdict(list)
        self.classified = True
        for file in files:
            self.classified &= CLASSES in file.kinds
            for code in file.codes(self.kind):
                self._files[code].append(file)
        self._columns: dict[tuple[int, int], list[int]] = defaultdict(list)
        for code in sorted(self._files):
            self._columns[place_of(code)[1:]].append(code)
        self._kept = lru_cache(maxsize=KEPT_TILES)(self._tile)

    @property
    def voxel_size(self) -> float:
        """m."""
        return self.lattice.voxel_size

    def tiles(self) -> Iterator[Tile]:
        """Every tile that holds a point, in a fixed order."""
        for code in sorted(self._files):
            yield self.tile(code)

    def __len__(self) -> int:
        return len(self._files)

    def places(self) -> list[tuple[int, tuple[int, int, int]]]:
        """Code and place of every tile that holds a point, in a fixed order."""
        return [(code, place_of(code)) for code in sorted(self._files)]

    def tile(self, code: int) -> Tile:
        """The tile with ``code``; a tile without voxels if it holds no point. The tiles that were
        used last stay in memory."""
        return self._kept(code)

    def _tile(self, code: int) -> Tile:
        records = self._read(self.kind, code, _MEASURED if self._measured else _SPOOLED)
        voxel, inverse = np.unique(records["voxel"], return_inverse=True)
        count, total = np.bincount(inverse, weights=records["count"]), None
        if self._measured:
            total = np.zeros(len(voxel), np.int64)
            np.add.at(total, inverse, records["total"])
        return Tile(place_of(code), voxel, count.astype(np.int32), total)

    def points(self, code: int) -> np.ndarray:
        """(n, 3) m, points of the tile with ``code``, to a few micrometres, in a fixed order.

        Raises:
            ValueError: the spool is that of voxels of a further size.
        """
        return self.offsets(code) + self.lattice.corner(code)

    def offsets(self, code: int) -> np.ndarray:
        """(n, 3) float32 m, the same from the corner of the tile (``Lattice.corner``)."""
        offset = self._added(code)
        return np.take(offset, _by_height(offset), axis=0)  # as an index, in half of the time

    def classified_points(self, code: int) -> tuple[np.ndarray, np.ndarray]:
        """As ``points``, with the class codes (n,) uint8 of the points, which the files keep.

        Raises:
            ValueError: the spool is that of voxels of a further size.
        """
        offset, classes = self._added(code), self._read(CLASSES, code, np.dtype(np.uint8))
        order = _by_height(offset)
        return np.take(offset, order, axis=0) + self.lattice.corner(code), classes[order]

    def _added(self, code: int) -> np.ndarray:
        """(n, 3) float32 m, points of a tile from its corner, as they were added."""
        if self.kind != VOXELS:
            raise ValueError(f"there are no points in tiles of {self.voxel_size:g} m voxels")
        return self._read(POINTS, code, _OFFSET).reshape(-1, 3)

    def columns(self) -> Mapping[tuple[int, int], Sequence[int]]:
        """(x, y) number of each column of tiles (``Lattice.columns``) -> the codes of its tiles
        that hold a point."""
        return {(x, y): codes for (y, x), codes in self._columns.items()}

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
        indices, counts, totals = [], [], []
        for code in codes_of(*(np.asarray(place) + NEIGHBOURS).T).tolist():
            if code not in self._files:
                continue
            tile = self.tile(code)
            corner = np.asarray(tile.place) * EDGE - low
            rows, index = _within(tile.voxel, *corner.tolist(), *shape.tolist())
            indices.append(index)
            counts.append(tile.count[rows])
            if tile.total is not None:
                totals.append(tile.total[rows])
        index = np.concatenate([*indices, np.empty(0, np.int64)])
        count = np.concatenate([*counts, np.empty(0, np.int32)])
        order = np.argsort(index, kind="stable")
        total = np.concatenate([*totals, np.empty(0, np.int64)])[order] if self._measured else None
        return Tile(place, index[order].astype(np.int32), count[order], total)

    def valued_around(
        self,
        place: tuple[int, int, int],
        reach: tuple[int, int, int],
        values: Callable[[int], np.ndarray],
    ) -> tuple[np.ndarray, np.ndarray]:
        """As ``around``, with a number for each voxel: positions (M,) int32, ascending, and values
        (M,) float32 of the voxels whose value is above 0.

        Args:
            values: gives those of the voxels of the tile with a code.
        """
        low = np.asarray(place) * EDGE - reach
        shape = np.array([EDGE + 2 * r for r in reach])
        indices, found = [np.empty(0, np.int64)], [np.empty(0, np.float32)]
        for code in codes_of(*(np.asarray(place) + NEIGHBOURS).T).tolist():
            if code not in self._files:
                continue
            value, tile = values(code), self.tile(code)
            corner = np.asarray(tile.place) * EDGE - low
            rows, index = _within(tile.voxel, *corner.tolist(), *shape.tolist())
            above = value[rows] > 0
            indices.append(index[above])
            found.append(value[rows[above]])
        index = np.concatenate(indices)
        order = np.argsort(index, kind="stable")
        return index[order].astype(np.int32), np.concatenate(found)[order]

    def columns_around(self, place: tuple[int, int, int], reach: tuple[int, int]) -> np.ndarray:
        """(K, 3) zyx on the lattice, all occupied voxels below, in and above a tile, and up to
        ``reach`` (y, x) voxels beside it.

        Raises:
            ValueError: the reach is larger than a tile.
        """
        if max(reach) > EDGE:
            raise ValueError(f"columns {reach} voxels away are beyond the next tile of {EDGE}")
        low = np.array(place[1:]) * EDGE - reach
        high = low + EDGE + 2 * np.array(reach)
        found = [np.empty((0, 3), np.int64)]
        for y, x in product((-1, 0, 1), repeat=2):
            for code in self._columns.get((place[1] + y, place[2] + x), ()):
                zyx = self.tile(code).zyx()
                found.append(zyx[((zyx[:, 1:] >= low) & (zyx[:, 1:] < high)).all(axis=1)])
        return np.concatenate(found)

    def centres(self, zyx: np.ndarray) -> np.ndarray:
        """(M, 3) xyz, m, centres of the voxels (M, 3) on the lattice."""
        return self.lattice.centres(zyx)

    def _read(self, kind: str, code: int, dtype: np.dtype) -> np.ndarray:
        parts = [file.read(kind, code, dtype) for file in self._files.get(code, ())]
        return np.concatenate([np.empty(0, dtype), *parts])


@numba.njit(**EXACT)
def _within(voxel, z, y, x, depth, height, width):  # pragma: no cover - compiled
    """Rows (m,) of the voxels (n,) of a tile that lie in a volume, and their positions in it.

    Args:
        voxel: positions in the tile.
        z, y, x: position of the tile in the volume.
    """
    rows, at, n = np.empty(len(voxel), np.int64), np.empty(len(voxel), np.int64), 0
    for i in range(len(voxel)):
        a = voxel[i] // (EDGE * EDGE) + z
        b, c = voxel[i] // EDGE % EDGE + y, voxel[i] % EDGE + x
        rows[n], at[n] = i, (a * height + b) * width + c
        n += (0 <= a < depth) & (0 <= b < height) & (0 <= c < width)
    return rows[:n], at[:n]


def _by_height(offset: np.ndarray) -> np.ndarray:
    """(n,) rows of float32 positions (n, 3) by z, then y, then x, as ``np.lexsort`` gives them, in
    a third of its time."""
    x, y, z = (_ascending(column) for column in offset.T)
    key = z.astype(np.uint64) << np.uint64(32) | y
    order = np.argsort(key)
    ranked = key[order]
    equal = np.zeros(len(order) + 1, bool)
    equal[1:-1] = ranked[1:] == ranked[:-1]
    places = np.flatnonzero(equal[1:] | equal[:-1])
    rows = order[places]
    order[places] = rows[np.lexsort((x[rows], key[rows]))]
    return order


def _ascending(values: np.ndarray) -> np.ndarray:
    """(n,) uint32 in the order of float32 values (n,)."""
    bits = np.ascontiguousarray(values).view(np.uint32)
    return np.where(bits >> 31, ~bits, bits | np.uint32(1 << 31))
