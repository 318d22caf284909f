"""The strongest response in the cross-section of a tower around a voxel.

A kernel responds on the axis of a tower, and a tower is wider than its axis. An occupied voxel
therefore takes the strongest response among the voxels within a radius in plan and a height above
it: among the occupied ones, or, for bodies that are hollow and have their axis in the air, among
all. A maximum is equivariant and does not increase differences, so it is a GENEO
(thesis 3.4), and its composition with a GENEO is one too.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from scenenet.convolution.occupancy import Occupancy
from scenenet.core.compilation import COMPILED


class Section(NamedTuple):
    """The cross-section of each occupied voxel.

    Attributes:
        at: (C,) int64, ascending: the voxels at which responses are needed, as
            ``Occupancy.flat`` numbers them; None for the occupied ones.
        starts: (M + 1,) int64, and rows: (N,) int32: the cross-section of occupied voxel i is
            ``rows[starts[i] : starts[i + 1]]``, with i itself first; rows are those of ``at``.
    """

    at: np.ndarray | None
    starts: np.ndarray
    rows: np.ndarray


FLOOR_ROUNDING = 1e-6
"""Tolerance in voxels when a length is divided into whole voxels."""


def whole_voxels(length: float, voxel_size: float) -> int:
    """Number of voxels that fit into ``length`` m."""
    return int(length / voxel_size + FLOOR_ROUNDING)


def section_offsets(radius: float, above: float, voxel_size: float) -> np.ndarray:
    """(S, 3) int64 offsets (z, y, x) of the voxels of a cross-section, the voxel itself first.

    Args:
        radius: m, in plan.
        above: m, height above the voxel.
        voxel_size: m.
    """
    wide, high = whole_voxels(radius, voxel_size), whole_voxels(above, voxel_size)
    side = np.arange(-wide, wide + 1)
    z, y, x = np.meshgrid(np.arange(high + 1), side, side, indexing="ij")
    squared = (y**2 + x**2) * voxel_size**2
    inside = squared <= (radius + FLOOR_ROUNDING) ** 2
    offsets = np.stack([z[inside], y[inside], x[inside]], axis=1)
    return offsets[np.argsort((offsets**2).sum(axis=1), kind="stable")].astype(np.int64)


def neighbours(occupancy: Occupancy, offsets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The occupied voxels in the cross-section of each occupied voxel.

    Args:
        offsets: from ``section_offsets``.

    Returns:
        starts (M + 1,) int64 and rows (N,) int32: the cross-section of voxel i is
        ``rows[starts[i] : starts[i + 1]]``, with i itself first.
    """
    starts = np.zeros(len(occupancy.index) + 1, np.int64)
    if len(occupancy.index) == 0:
        return starts, np.empty(0, np.int32)
    arguments = (occupancy.index, occupancy.offsets, occupancy.shape, offsets)
    _find(*arguments, starts, np.empty(0, np.int32), False)
    rows = np.empty(int(starts[-1]), np.int32)
    _find(*arguments, starts, rows, True)
    return starts, rows


def section_of(occupancy: Occupancy, offsets: np.ndarray, *, hollow: bool) -> Section:
    """The cross-section of each occupied voxel.

    Args:
        offsets: from ``section_offsets``.
        hollow: whether empty voxels belong to it.
    """
    if not hollow:
        return Section(None, *neighbours(occupancy, offsets))
    depth, height, width = occupancy.shape
    volume = depth * height * width
    needed = np.zeros(len(occupancy) * volume, bool)
    starts = np.zeros(len(occupancy.index) + 1, np.int64)
    arguments = (occupancy.index, occupancy.offsets, occupancy.shape, offsets)
    _mark(*arguments, needed, starts)
    at = np.flatnonzero(needed)
    # Only where it is needed: the rest of this memory is never touched.
    row_of = np.empty(len(needed), np.int32)
    row_of[at] = np.arange(len(at), dtype=np.int32)
    rows = np.empty(int(starts[-1]), np.int32)
    _fill(*arguments, row_of, rows)
    return Section(at, starts, rows)


def part_of(section: Section, voxels: np.ndarray) -> Section:
    """The cross-sections of some of the occupied voxels (R,), with the same rows."""
    starts, lengths = section.starts[voxels], np.diff(section.starts)[voxels]
    ends = np.append(0, np.cumsum(lengths))
    at = np.repeat(starts - ends[:-1], lengths) + np.arange(ends[-1])
    return Section(section.at, ends, section.rows[at])


@numba.njit(**COMPILED)
def _mark(index, grids, shape, offsets, needed, starts):  # pragma: no cover - compiled
    """Mark the voxels of all cross-sections in ``needed``, and count those of each in
    ``starts``."""
    depth, height, width = shape
    for b in range(len(grids) - 1):
        for i in range(grids[b], grids[b + 1]):
            z = index[i] // (height * width)
            y = index[i] // width % height
            x = index[i] % width
            count = 0
            for k in range(len(offsets)):
                a, b_, c = z + offsets[k, 0], y + offsets[k, 1], x + offsets[k, 2]
                if a < depth and 0 <= b_ < height and 0 <= c < width:
                    needed[((b * depth + a) * height + b_) * width + c] = True
                    count += 1
            starts[i + 1] = starts[i] + count


@numba.njit(**COMPILED)
def _fill(index, grids, shape, offsets, row_of, rows):  # pragma: no cover - compiled
    """Write the rows of all cross-sections, one after the other."""
    depth, height, width = shape
    at = 0
    for b in range(len(grids) - 1):
        for i in range(grids[b], grids[b + 1]):
            z = index[i] // (height * width)
            y = index[i] // width % height
            x = index[i] % width
            for k in range(len(offsets)):
                a, b_, c = z + offsets[k, 0], y + offsets[k, 1], x + offsets[k, 2]
                if a < depth and 0 <= b_ < height and 0 <= c < width:
                    rows[at] = row_of[((b * depth + a) * height + b_) * width + c]
                    at += 1


@numba.njit(**COMPILED)
def strongest(responses, starts, rows):  # pragma: no cover - compiled
    """(M,) int32 row of the highest of ``responses`` (C,) in each of M cross-sections; of equal
    ones the nearest."""
    out = np.empty(len(starts) - 1, np.int32)
    for i in range(len(out)):
        best = rows[starts[i]]
        for k in range(starts[i] + 1, starts[i + 1]):
            if responses[rows[k]] > responses[best]:
                best = rows[k]
        out[i] = best
    return out


@numba.njit(**COMPILED)
def highest(responses, starts, rows):  # pragma: no cover - compiled
    """(M,) the highest of ``responses`` (C,) in each of M cross-sections: ``responses`` at
    ``strongest``, in a third of the time, because the row of the highest is not followed."""
    out = np.empty(len(starts) - 1, responses.dtype)
    for i in range(len(out)):
        best = responses[rows[starts[i]]]
        for k in range(starts[i] + 1, starts[i + 1]):
            response = responses[rows[k]]
            best = response if response > best else best
        out[i] = best
    return out


@numba.njit(**COMPILED)
def _find(index, grids, shape, offsets, starts, rows, fill):  # pragma: no cover - compiled
    """Count the neighbours of each voxel into ``starts``, or write them into ``rows``."""
    depth, height, width = shape
    row_of = np.full(depth * height * width, -1, np.int32)
    for b in range(len(grids) - 1):
        for i in range(grids[b], grids[b + 1]):
            row_of[index[i]] = i
        for i in range(grids[b], grids[b + 1]):
            z = index[i] // (height * width)
            y = index[i] // width % height
            x = index[i] % width
            at = starts[i]
            for k in range(len(offsets)):
                a, b_, c = z + offsets[k, 0], y + offsets[k, 1], x + offsets[k, 2]
                if a < depth and 0 <= b_ < height and 0 <= c < width:
                    row = row_of[(a * height + b_) * width + c]
                    if row >= 0:
                        if fill:
                            rows[at] = row
                        at += 1
            if not fill:
                starts[i + 1] = at
        for i in range(grids[b], grids[b + 1]):
            row_of[index[i]] = -1
