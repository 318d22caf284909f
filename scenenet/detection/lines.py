"""Which points lie on a thin straight line, as a conductor is over a few metres.

A branch, the edge of a roof and the rail of a bridge are thick or have other points beside them; a
conductor hangs in air. The points say so at any density, above trees and between other conductors.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from scenenet.core.compilation import COMPILED
from scenenet.detection.conductor_rules import (
    LINE_BESIDE,
    LINE_M,
    LINE_PIECES,
    LINE_THICK_M,
    RING_M,
    RISE,
)


class Line(NamedTuple):
    """What a line is, as ``scenenet.detection.conductor_rules`` says.

    It is an argument of the compiled functions: a constant of another module would stay in their
    machine code on disk when that module changes.
    """

    reach: float
    thick: float
    inner: float
    outer: float
    beside: float
    pieces: int
    rise: float


LINE = Line(LINE_M, LINE_THICK_M, *RING_M, LINE_BESIDE, LINE_PIECES, RISE)
"""The line that conductors are."""

CELL_M = 1.0
"""m, cells in which neighbours are looked up."""

AZIMUTHS, SLOPES = 60, 10
"""Number of directions among which those of lines are looked for: about 3 degrees, as wide as a
line at ``LINE_M``."""

TRIED = 4
"""Number of directions that are measured at each point, those with most neighbours first."""

SAMPLE = 2000
"""Points that are tested first where there are many. A forest without conductors has no line at any
of them."""

PARALLEL = 10.0
"""degrees, largest difference between the directions that a line has at its points."""


def points_on_lines(points: np.ndarray, tested: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The tested points that lie on a thin, nearly level line.

    Memory grows with the volume of the bounding box of the points, 8 bytes for each m3.

    Args:
        points: (N, 3) m.
        tested: (M,) rows of the points to test.

    Returns:
        rows (K,) of ``points``, and unit vectors (K, 3) along the lines.
    """
    if len(tested) == 0:
        return np.empty(0, np.int64), np.empty((0, 3))
    cells = np.floor((points - points.min(axis=0)) / CELL_M).astype(np.int64)
    shape = cells.max(axis=0) + 1
    number = np.ravel_multi_index(tuple(cells.T), tuple(shape))
    order = np.argsort(number, kind="stable")
    starts = np.searchsorted(number[order], np.arange(int(shape.prod()) + 1))
    grid = cells, shape, order, starts, LINE
    step = len(tested) // SAMPLE
    if step > 1 and not _on_lines(points, tested[::step], *grid)[0].any():
        return np.empty(0, np.int64), np.empty((0, 3))
    on_line, direction = _on_lines(points, tested, *grid)
    rows, direction = tested[on_line], direction[on_line]
    same = _continued(points[rows], direction)
    return rows[same], direction[same]


def _continued(points: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """(K,) bool, whether other points (K, 3) m on lines are on the line of each, with about its
    direction (K, 3). In a crown, lines through neighbouring points point anywhere."""
    from scipy.spatial import cKDTree

    if len(points) == 0:
        return np.zeros(0, bool)
    pairs = cKDTree(points).query_pairs(LINE_M, output_type="ndarray")
    pairs = np.concatenate([pairs, pairs[:, ::-1]])
    one, other = pairs.T
    offset = points[other] - points[one]
    along = np.einsum("ni,ni->n", offset, direction[one])
    beside = np.einsum("ni,ni->n", offset, offset) - along**2
    parallel = np.abs(np.einsum("ni,ni->n", direction[one], direction[other]))
    on = (beside <= RING_M[0] ** 2) & (parallel >= np.cos(np.radians(PARALLEL)))
    pieces = np.unique(np.column_stack([one[on], np.rint(along[on])]), axis=0)[:, 0].astype(int)
    return np.bincount(pieces, minlength=len(points)) >= LINE_PIECES - 1


@numba.njit(**COMPILED)
def _on_lines(points, tested, cells, shape, order, starts, line):  # pragma: no cover - compiled
    """Whether each of the rows ``tested`` (M,) is on a line, (M,) bool, and unit vectors (M, 3)
    along the best lines tried. ``cells`` (N, 3) is the cell of each point in a grid of ``shape``;
    ``order`` has the rows of each cell one after another, from ``starts`` on."""
    found = np.zeros(len(tested), np.bool_)
    direction = np.zeros((len(tested), 3))
    near = np.empty((len(points), 4))
    votes = np.empty(AZIMUTHS * SLOPES, np.int64)
    towards = np.empty((AZIMUTHS * SLOPES, 3))
    u, middle = np.empty(3), np.empty(3)
    for row in range(len(tested)):
        if _in_crown(points, tested[row], cells, shape, order, starts, line):
            continue
        n = _neighbours(points, tested[row], cells, shape, order, starts, line, near)
        _vote(near[:n], line, votes, towards)
        best = 0
        for _ in range(TRIED):
            most = np.argmax(votes)
            if votes[most] == 0:
                break
            votes[most] = 0
            u[:] = towards[most]
            _fit(near[:n], line, u, middle)
            on = _pieces_on_line(near[:n], line, u, middle)
            if on > best:
                best = on
                direction[row] = u
        found[row] = best >= line.pieces
    return found, direction


@numba.njit(**COMPILED)
def _neighbours(points, i, cells, shape, order, starts, line, near):  # pragma: no cover - compiled
    """Write the offsets of the neighbours of point ``i`` that may lie on a line through it, or
    beside one, and their squared lengths, into ``near`` (N, 4); returns their number."""
    n = 0
    x, y, z = points[i]
    steps = int(np.ceil(line.reach / CELL_M))
    for a in range(max(cells[i, 0] - steps, 0), min(cells[i, 0] + steps + 1, shape[0])):
        for b in range(max(cells[i, 1] - steps, 0), min(cells[i, 1] + steps + 1, shape[1])):
            column = (a * shape[1] + b) * shape[2]
            far = (np.hypot(a - cells[i, 0], b - cells[i, 1]) + 1.5) * CELL_M
            high = int((line.rise * far + line.outer) / CELL_M) + 1
            first = column + max(cells[i, 2] - high, 0)
            last = column + min(cells[i, 2] + high + 1, shape[2])
            for k in range(starts[first], starts[last]):
                j = order[k]
                dx, dy, dz = points[j, 0] - x, points[j, 1] - y, points[j, 2] - z
                planar = dx * dx + dy * dy
                if (
                    planar > line.reach * line.reach
                    or abs(dz) > line.rise * np.sqrt(planar) + line.outer
                ):
                    continue
                near[n, 0], near[n, 1], near[n, 2], near[n, 3] = dx, dy, dz, planar + dz * dz
                n += 1
    return n


@numba.njit(**COMPILED)
def _in_crown(points, i, cells, shape, order, starts, line):  # pragma: no cover - compiled
    """Whether the nearest neighbours of point ``i`` are not on one line. Most points of a crown are
    excluded by it, at a small cost."""
    n = 0
    total, product = np.zeros(3), np.zeros((3, 3))
    offset = np.empty(3)
    for a in range(max(cells[i, 0] - 1, 0), min(cells[i, 0] + 2, shape[0])):
        for b in range(max(cells[i, 1] - 1, 0), min(cells[i, 1] + 2, shape[1])):
            column = (a * shape[1] + b) * shape[2]
            first = column + max(cells[i, 2] - 1, 0)
            last = column + min(cells[i, 2] + 2, shape[2])
            for k in range(starts[first], starts[last]):
                square = 0.0
                for axis in range(3):
                    offset[axis] = points[order[k], axis] - points[i, axis]
                    square += offset[axis] * offset[axis]
                if square <= line.outer**2:
                    n += 1
                    for axis in range(3):
                        total[axis] += offset[axis]
                        for other in range(3):
                            product[axis, other] += offset[axis] * offset[other]
    if n < line.pieces:
        return False
    trace = 0.0
    for axis in range(3):
        for other in range(3):
            product[axis, other] = (product[axis, other] - total[axis] * total[other] / n) / n
        trace += product[axis, axis]
    # The largest eigenvalue, by squaring: the variance along the line.
    power = product / max(trace, 1e-12)
    for _ in range(4):
        power = power @ power
        power /= max(power[0, 0] + power[1, 1] + power[2, 2], 1e-300)
    along = (power * product).sum()
    return trace - along > line.thick**2


@numba.njit(**COMPILED)
def _vote(near, line, votes, towards):  # pragma: no cover - compiled
    """Count the neighbours in each direction into ``votes`` (D,), and sum their offsets into
    ``towards`` (D, 3)."""
    votes[:] = 0
    towards[:] = 0
    for k in range(len(near)):
        x, y, z = near[k, 0], near[k, 1], near[k, 2]
        planar = np.sqrt(x * x + y * y)
        if planar <= line.reach / 4 or abs(z) >= line.rise * planar:
            continue
        if y < 0:
            x, y, z = -x, -y, -z
        # On a square instead of a circle: an arc tangent would take most of the time.
        azimuth = min(int((1 - x / (abs(x) + y)) / 2 * AZIMUTHS), AZIMUTHS - 1)
        slope = int((z / (line.rise * planar) + 1) / 2 * SLOPES)
        way = azimuth * SLOPES + slope
        votes[way] += 1
        towards[way, 0] += x
        towards[way, 1] += y
        towards[way, 2] += z


@numba.njit(**COMPILED)
def _fit(near, line, u, middle):  # pragma: no cover - compiled
    """Turn ``u`` (3,) into the direction of the points around its line, and write their middle,
    relative to the point at the origin, into ``middle`` (3,): the point may be on one conductor of
    a bundle. ``u`` becomes a unit vector."""
    middle[:] = 0
    for _ in range(2):
        length = np.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
        a, b, c = u[0] / length, u[1] / length, u[2] / length
        u[:] = 0
        x = y = z = 0.0
        n = 0
        for k in range(len(near)):
            along = near[k, 0] * a + near[k, 1] * b + near[k, 2] * c
            if near[k, 3] - along * along <= line.inner**2:
                n += 1
                x += near[k, 0] - along * a
                y += near[k, 1] - along * b
                z += near[k, 2] - along * c
                u[0] += near[k, 0] * along
                u[1] += near[k, 1] * along
                u[2] += near[k, 2] * along
        middle[0], middle[1], middle[2] = x / n, y / n, z / n
    u /= np.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])


@numba.njit(**COMPILED)
def _pieces_on_line(near, line, u, middle):  # pragma: no cover - compiled
    """Number of pieces of 1 m along ``u`` (3,) that have a point; 0 with points beside the line."""
    if (middle * middle).sum() > line.thick**2:
        return 0
    longest = np.ceil(np.sqrt(1 + line.rise * line.rise) * line.reach) + 2
    pieces = np.zeros(2 * int(longest) + 1, np.bool_)
    on = beside = 0
    for k in range(len(near)):
        x, y, z = near[k, 0] - middle[0], near[k, 1] - middle[1], near[k, 2] - middle[2]
        along = x * u[0] + y * u[1] + z * u[2]
        square = x * x + y * y + z * z - along * along
        if square <= line.thick**2:
            on += 1
            pieces[int(np.floor(along + longest + 0.5))] = True
        elif line.inner**2 < square <= line.outer**2:
            beside += 1
    return pieces.sum() if beside <= line.beside * on else 0
