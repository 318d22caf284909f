"""The points on conductors of a survey, looked for block by block."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor

import numba
import numpy as np

from scenenet.core.compilation import EXACT
from scenenet.detection.conductor_rules import (
    HIGHEST_M,
    LINE_CELL_M,
    LINE_M,
    RISE,
    TESTED_CELL_M,
)
from scenenet.detection.surroundings import Surroundings
from scenenet.detection.within import within

BLOCK_M, BLOCKS_KEPT = 32.0, 256
"""m, edge of the blocks in which points on conductors are looked for, and number in memory."""

GROUND = 5
"""Percentile of the elevations in a block that counts as its ground."""

Block = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Positions (M, 3) m and directions (M, 3) of the points on conductors, and positions (N, 3) m of
other points that were tested."""


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
        inside = [_within(places, *place, radius) for places, _, _ in found]
        beside = [_within(others, *place, radius) for _, _, others in found]
        return (
            np.concatenate([block[0][rows] for block, rows in zip(found, inside, strict=True)]),
            np.concatenate([block[1][rows] for block, rows in zip(found, inside, strict=True)]),
            np.concatenate([block[2][rows] for block, rows in zip(found, beside, strict=True)]),
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
            return np.empty((0, 3)), np.empty((0, 3)), np.empty((0, 3))
        ground = np.percentile(near[:, 2], GROUND)
        above = near[:, 2] - ground
        near = near[(above >= self._lowest - RISE * LINE_M) & (above <= HIGHEST_M)]
        near = near[_one_per_cell(near, LINE_CELL_M)]
        tested = _one_per_cell(near, TESTED_CELL_M)
        inside = np.abs(near[tested, :2] - middle).max(axis=1) <= BLOCK_M / 2
        tested = tested[inside & (near[tested, 2] >= ground + self._lowest)]
        rows, directions = points_on_lines(near, tested)
        return near[rows], directions, near[np.setdiff1d(tested, rows)]


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
