"""The points on conductors of a survey, looked for block by block."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import NamedTuple

import numba
import numpy as np

from scenenet.core.compilation import EXACT
from scenenet.detection.conductor_rules import (
    HIGHEST_M,
    LINE_CELL_M,
    LINE_M,
    RISE,
    RISE_OVER_GROUND,
    TESTED_CELL_M,
)
from scenenet.detection.surroundings import Surroundings
from scenenet.detection.within import within

BLOCK_M, BLOCKS_KEPT = 32.0, 256
"""m, edge of the blocks in which points on conductors are looked for, and number in memory."""

GROUND = 5
"""Percentile of the elevations in a block that counts as its ground."""

SLOPE_CELL_M, SLOPE_M, SLOPE_SEEN = 4.0, 3.0, 0.7
"""m, edge of the cells whose lowest points show the slope of the ground in a block, m that they may
be off a plane, and the smallest share of them that is not further off. A hillside curves by as much
over a block; the lowest points at a house are on its roof and beside it."""

SLOPE_CELLS = 32
"""Cells that show the slope of the ground, at least: half of those in a block. A plane through a
few cells at the edge of a survey is as steep as the crowns in them are high."""


class Block(NamedTuple):
    """What is known of a block.

    Attributes:
        places, directions: (M, 3) m, points on conductors, and (M, 3) unit vectors along them.
        others: (N, 3) m, other points that were tested.
        rise: steepest slope of a conductor there.
    """

    places: np.ndarray
    directions: np.ndarray
    others: np.ndarray
    rise: float


class ConductorBlocks:
    """The points on conductors, looked for in a block when it is needed or expected.

    One thread looks, while the caller measures what is known already.
    """

    def __init__(self, points: Surroundings, lowest: float) -> None:
        """Nothing is looked for yet; arguments as ``ConductorPoints``."""
        self._points, self._lowest = points, lowest
        self._thread = ThreadPoolExecutor(1, "conductors")
        self._blocks: OrderedDict[tuple[int, int], Future[Block]] = OrderedDict()

    def expect(self, place: np.ndarray, radius: float) -> None:
        """Begin to look within a radius in m of a place (2,) m."""
        for number in _numbers(place, radius):
            self._block(number)

    def near(self, place: np.ndarray, radius: float) -> Block:
        """What is within a radius in m of a place (2,) m."""
        blocks = [self._block(number) for number in _numbers(place, radius)]
        found = [block.result() for block in blocks]
        inside = [_within(block.places, *place, radius) for block in found]
        beside = [_within(block.others, *place, radius) for block in found]
        return Block(
            np.concatenate([b.places[rows] for b, rows in zip(found, inside, strict=True)]),
            np.concatenate([b.directions[rows] for b, rows in zip(found, inside, strict=True)]),
            np.concatenate([b.others[rows] for b, rows in zip(found, beside, strict=True)]),
            max(block.rise for block in found),
        )

    def _block(self, number: tuple[int, int]) -> Future[Block]:
        """A block, looked for or not; those that were asked for last stay in memory."""
        if number not in self._blocks:
            self._blocks[number] = self._thread.submit(self._in_block, *number)
            if len(self._blocks) > BLOCKS_KEPT:
                self._blocks.popitem(last=False)[1].cancel()
        self._blocks.move_to_end(number)
        return self._blocks[number]

    def _in_block(self, x: int, y: int) -> Block:
        """What is within a block."""
        from scenenet.detection.lines import points_on_lines  # compiled: half a second to import

        middle = (np.array([x, y]) + 0.5) * BLOCK_M
        near = self._points(middle, BLOCK_M / np.sqrt(2) + LINE_M)
        if len(near) == 0:
            return Block(np.empty((0, 3)), np.empty((0, 3)), np.empty((0, 3)), RISE)
        rise = max(RISE, _slope(near) + RISE_OVER_GROUND)
        ground = np.percentile(near[:, 2], GROUND)
        above = near[:, 2] - ground
        near = near[(above >= self._lowest - rise * LINE_M) & (above <= HIGHEST_M)]
        near = near[_one_per_cell(near, LINE_CELL_M)]
        tested = _one_per_cell(near, TESTED_CELL_M)
        inside = np.abs(near[tested, :2] - middle).max(axis=1) <= BLOCK_M / 2
        tested = tested[inside & (near[tested, 2] >= ground + self._lowest)]
        rows, directions = points_on_lines(near, tested, rise)
        return Block(near[rows], directions, near[np.setdiff1d(tested, rows)], rise)


def _slope(points: np.ndarray) -> float:
    """Slope of the ground below points (N, 3) m; 0 where they show none."""
    cells = np.floor(points[:, :2] / SLOPE_CELL_M).astype(np.int64)
    order = np.lexsort((points[:, 2], cells[:, 1], cells[:, 0]))
    first = np.append(True, (np.diff(cells[order], axis=0) != 0).any(axis=1))
    if first.sum() < SLOPE_CELLS:
        return 0.0
    low = points[order[first]] - points.mean(axis=0)
    design = np.column_stack([low[:, :2], np.ones(len(low))])
    plane = np.linalg.lstsq(design, low[:, 2], rcond=None)[0]
    on_plane = np.abs(low[:, 2] - design @ plane) <= SLOPE_M
    return float(np.hypot(plane[0], plane[1])) if on_plane.mean() >= SLOPE_SEEN else 0.0


def _numbers(place: np.ndarray, radius: float) -> Iterator[tuple[int, int]]:
    """The blocks within a radius in m of a place (2,) m."""
    low, high = (np.floor((place + r) / BLOCK_M).astype(int).tolist() for r in (-radius, radius))
    for x in range(low[0], high[0] + 1):
        for y in range(low[1], high[1] + 1):
            yield x, y


@numba.njit(**EXACT)
def _within(xyz, x, y, radius):  # pragma: no cover - compiled
    """Rows of positions (N, 3) m within a planar radius in m of a place."""
    rows, n = np.empty(len(xyz), np.int64), 0
    for i in range(len(xyz)):
        rows[n] = i
        n += within(xyz[i, 0] - x, xyz[i, 1] - y, radius)
    return rows[:n]


def _one_per_cell(points: np.ndarray, size: float) -> np.ndarray:
    """Rows (M,) of the first of the points (N, 3) m in each cell of ``size`` m."""
    if len(points) == 0:
        return np.empty(0, np.int64)
    cells = np.floor(points / size).astype(np.int64)
    cells -= cells.min(axis=0)
    number = np.ravel_multi_index(tuple(cells.T), tuple(cells.max(axis=0) + 1))
    # Cell and row in one number: whole numbers are sorted several times as fast as an index.
    bits = len(points).bit_length()
    ordered = np.sort(number << bits | np.arange(len(points)))
    starts = np.append(True, np.diff(ordered >> bits) > 0)
    return np.sort(ordered[starts] & ((1 << bits) - 1))
