"""Which points lie on a thin straight line, as a conductor is over a few metres.

A branch, the edge of a roof and the rail of a bridge are thick or have other points beside them; a
conductor hangs in air. The points say so at any density, above trees and between other conductors.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
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

ROUNDING = 1e-6
"""m, added where a cell is left out because no point in it can matter."""

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


class Grid(NamedTuple):
    """Points in cells of ``CELL_M``, those of a cell one after another.

    Attributes:
        x, y, z: (N,) m.
        origin: (3,) m, lowest corner of the first cell.
        shape: (3,) number of cells.
        starts: (C + 1,) where the points of each cell start, with the cells of a column one after
            another.
    """

    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    origin: np.ndarray
    shape: np.ndarray
    starts: np.ndarray


def points_on_lines(
    points: np.ndarray, tested: np.ndarray, rise: float = RISE
) -> tuple[np.ndarray, np.ndarray]:
    """The tested points that lie on a thin, nearly level line.

    Memory grows with the volume of the bounding box of the points, 8 bytes for each m3.

    Args:
        points: (N, 3) m.
        tested: (M,) rows of the points to test.
        rise: steepest slope of a line.

    Returns:
        rows (K,) of ``points``, and unit vectors (K, 3) along the lines.
    """
    if len(tested) == 0:
        return np.empty(0, np.int64), np.empty((0, 3))
    grid, cells = _grid(points)
    line = LINE._replace(rise=rise)
    step = len(tested) // SAMPLE
    if step > 1:
        few = tested[::step]
        if not _in_threads(grid, points[few], cells[few], line)[0].any():
            return np.empty(0, np.int64), np.empty((0, 3))
    on_line, direction = _in_threads(grid, points[tested], cells[tested], line)
    rows, direction = tested[on_line], direction[on_line]
    same = _continued(points[rows], direction)
    return rows[same], direction[same]


def _grid(points: np.ndarray) -> tuple[Grid, np.ndarray]:
    """The points (N, 3) m by their cells, and the cell (N, 3) of each."""
    origin = points.min(axis=0)
    cells = np.floor((points - origin) / CELL_M).astype(np.int64)
    shape = cells.max(axis=0) + 1
    number = np.ravel_multi_index(tuple(cells.T), tuple(shape))
    x, y, z = np.ascontiguousarray(points[np.argsort(number, kind="stable")].T)
    starts = np.zeros(int(shape.prod()) + 1, np.int64)
    np.cumsum(np.bincount(number, minlength=len(starts) - 1), out=starts[1:])
    return Grid(x, y, z, origin, shape, starts), cells


def _in_threads(
    grid: Grid, places: np.ndarray, cells: np.ndarray, line: Line
) -> tuple[np.ndarray, np.ndarray]:
    """``_on_lines`` with a share of the places for each processor."""
    threads = numba.get_num_threads()
    shares = zip(
        np.array_split(np.ascontiguousarray(places), threads),
        np.array_split(np.ascontiguousarray(cells), threads),
        strict=True,
    )
    with ThreadPoolExecutor(threads) as pool:
        parts = list(pool.map(lambda share: _on_lines(grid, *share, line), shares))
    found, direction = zip(*parts, strict=True)
    return np.concatenate(found), np.concatenate(direction)


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


@numba.njit(nogil=True, **COMPILED)
def _on_lines(grid, places, cells, line):  # pragma: no cover - compiled
    """Whether each place (M, 3) m, a point in the cell (M, 3) of ``grid``, is on a line, (M,) bool,
    and unit vectors (M, 3) along the best lines tried."""
    found = np.zeros(len(places), np.bool_)
    direction = np.zeros((len(places), 3))
    near = np.empty((4, len(grid.x)))
    inside = np.empty(len(grid.x), np.bool_)
    way = np.empty(len(grid.x), np.int32)
    votes = np.empty(AZIMUTHS * SLOPES + 1, np.int32)
    towards = np.empty((AZIMUTHS * SLOPES + 1, 3))
    u, middle = np.empty(3), np.empty(3)
    for row in range(len(places)):
        if _in_crown(grid, places[row], cells[row], line):
            continue
        n = _neighbours(grid, places[row], cells[row], line, near)
        x, y, z, square = near[0, :n], near[1, :n], near[2, :n], near[3, :n]
        _vote(x, y, z, line, way[:n], votes, towards)
        best = 0
        for _ in range(TRIED):
            most = np.argmax(votes[:-1])
            if votes[most] == 0:
                break
            votes[most] = 0
            # By number: numba compiles a check of shapes, with its message, into the assignment
            # of a row to a row, which takes seconds.
            for k in range(3):
                u[k] = towards[most, k]
            _fit(x, y, z, square, line, u, middle, inside[:n])
            on = _pieces_on_line(x, y, z, line, u, middle)
            if on > best:
                best = on
                for k in range(3):
                    direction[row, k] = u[k]
        found[row] = best >= line.pieces
    return found, direction


@numba.njit(**COMPILED)
def _neighbours(grid, place, cell, line, near):  # pragma: no cover - compiled
    """Write the offsets of the neighbours of a place that may lie on a line through it, or beside
    one, and their squared lengths, into ``near`` (4, N); returns their number."""
    n = 0
    px, py, pz = place
    gx, gy, gz = px - grid.origin[0], py - grid.origin[1], pz - grid.origin[2]
    x, y, z, square = near[0], near[1], near[2], near[3]
    steps = int(np.ceil(line.reach / CELL_M))
    for a in range(max(cell[0] - steps, 0), min(cell[0] + steps + 1, grid.shape[0])):
        west, east = gx - a * CELL_M, (a + 1) * CELL_M - gx
        for b in range(max(cell[1] - steps, 0), min(cell[1] + steps + 1, grid.shape[1])):
            south, north = gy - b * CELL_M, (b + 1) * CELL_M - gy
            beside = max(-west, -east, 0.0) ** 2 + max(-south, -north, 0.0) ** 2
            if beside > line.reach**2 + ROUNDING:
                continue
            far = np.sqrt(max(west, east) ** 2 + max(south, north) ** 2)
            high = line.rise * min(far, line.reach) + line.outer + ROUNDING
            column = (a * grid.shape[1] + b) * grid.shape[2]
            first = column + max(int(np.floor((gz - high) / CELL_M)), 0)
            last = column + min(int(np.floor((gz + high) / CELL_M)) + 1, grid.shape[2])
            for k in range(grid.starts[first], grid.starts[last]):
                dx, dy, dz = grid.x[k] - px, grid.y[k] - py, grid.z[k] - pz
                planar = dx * dx + dy * dy
                x[n], y[n], z[n], square[n] = dx, dy, dz, planar + dz * dz
                # Without a branch: the processor could not foresee it.
                n += (planar <= line.reach * line.reach) & (
                    abs(dz) <= line.rise * np.sqrt(planar) + line.outer
                )
    return n


@numba.njit(**COMPILED)
def _in_crown(grid, place, cell, line):  # pragma: no cover - compiled
    """Whether the nearest neighbours of a place are not on one line. Most points of a crown are
    excluded by it, at a small cost."""
    n = 0
    px, py, pz = place
    sx = sy = sz = xx = xy = xz = yy = yz = zz = 0.0
    for a in range(max(cell[0] - 1, 0), min(cell[0] + 2, grid.shape[0])):
        for b in range(max(cell[1] - 1, 0), min(cell[1] + 2, grid.shape[1])):
            column = (a * grid.shape[1] + b) * grid.shape[2]
            first = column + max(cell[2] - 1, 0)
            last = column + min(cell[2] + 2, grid.shape[2])
            for k in range(grid.starts[first], grid.starts[last]):
                x, y, z = grid.x[k] - px, grid.y[k] - py, grid.z[k] - pz
                if x * x + y * y + z * z <= line.outer**2:
                    n += 1
                    sx, sy, sz = sx + x, sy + y, sz + z
                    xx, xy, xz = xx + x * x, xy + x * y, xz + x * z
                    yy, yz, zz = yy + y * y, yz + y * z, zz + z * z
    if n < line.pieces:
        return False
    xx, xy, xz = (xx - sx * sx / n) / n, (xy - sx * sy / n) / n, (xz - sx * sz / n) / n
    yy, yz, zz = (yy - sy * sy / n) / n, (yz - sy * sz / n) / n, (zz - sz * sz / n) / n
    trace = xx + yy + zz
    # The largest eigenvalue, by squaring: the variance along the line.
    scale = max(trace, 1e-12)
    p, q, r, s, t, w = xx / scale, xy / scale, xz / scale, yy / scale, yz / scale, zz / scale
    for _ in range(4):
        p, q, r, s, t, w = (
            p * p + q * q + r * r,
            p * q + q * s + r * t,
            p * r + q * t + r * w,
            q * q + s * s + t * t,
            q * r + s * t + t * w,
            r * r + t * t + w * w,
        )
        scale = max(p + s + w, 1e-300)
        p, q, r, s, t, w = p / scale, q / scale, r / scale, s / scale, t / scale, w / scale
    along = p * xx + s * yy + w * zz + 2 * (q * xy + r * xz + t * yz)
    return trace - along > line.thick**2


@numba.njit(**COMPILED)
def _vote(x, y, z, line, way, votes, towards):  # pragma: no cover - compiled
    """Count the neighbours in each direction into ``votes`` (D + 1,), and sum their offsets into
    ``towards`` (D + 1, 3); the last are of those that do not count. ``way`` (N,) is overwritten."""
    votes[:] = 0
    towards[:] = 0
    for k in range(len(x)):
        side = -1.0 if y[k] < 0 else 1.0
        planar = np.sqrt(x[k] * x[k] + y[k] * y[k])
        # On a square instead of a circle: an arc tangent would take most of the time.
        around = side * x[k] / (abs(x[k]) + abs(y[k]))
        azimuth = min(np.int32((1 - around) / 2 * AZIMUTHS), np.int32(AZIMUTHS - 1))
        slope = np.int32((side * z[k] / (line.rise * planar) + 1) / 2 * SLOPES)
        counts = (planar > line.reach / 4) & (abs(z[k]) < line.rise * planar)
        way[k] = azimuth * np.int32(SLOPES) + slope if counts else np.int32(AZIMUTHS * SLOPES)
    for k in range(len(x)):
        side = -1.0 if y[k] < 0 else 1.0
        votes[way[k]] += 1
        towards[way[k], 0] += side * x[k]
        towards[way[k], 1] += side * y[k]
        towards[way[k], 2] += side * z[k]


@numba.njit(**COMPILED)
def _fit(x, y, z, square, line, u, middle, inside):  # pragma: no cover - compiled
    """Turn ``u`` (3,) into the direction of the points around its line, and write their middle,
    relative to the point at the origin, into ``middle`` (3,): the point may be on one conductor of
    a bundle. ``u`` becomes a unit vector. ``inside`` (N,) is overwritten."""
    for _ in range(2):
        length = np.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
        a, b, c = u[0] / length, u[1] / length, u[2] / length
        for k in range(len(x)):
            along = x[k] * a + y[k] * b + z[k] * c
            inside[k] = square[k] - along * along <= line.inner**2
        ux = uy = uz = mx = my = mz = 0.0
        n = 0
        for k in range(len(x)):
            if inside[k]:
                along = x[k] * a + y[k] * b + z[k] * c
                n += 1
                mx, my, mz = mx + x[k] - along * a, my + y[k] - along * b, mz + z[k] - along * c
                ux, uy, uz = ux + x[k] * along, uy + y[k] * along, uz + z[k] * along
        u[0], u[1], u[2] = ux, uy, uz
        middle[0], middle[1], middle[2] = mx / n, my / n, mz / n
    u /= np.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])


@numba.njit(**COMPILED)
def _pieces_on_line(x, y, z, line, u, middle):  # pragma: no cover - compiled
    """Number of pieces of 1 m along ``u`` (3,) that have a point; 0 with points beside the line."""
    if (middle * middle).sum() > line.thick**2:
        return 0
    ux, uy, uz = u
    mx, my, mz = middle
    on = beside = 0
    for k in range(len(x)):
        dx, dy, dz = x[k] - mx, y[k] - my, z[k] - mz
        along = dx * ux + dy * uy + dz * uz
        square = dx * dx + dy * dy + dz * dz - along * along
        on += square <= line.thick**2
        beside += (square > line.inner**2) & (square <= line.outer**2)
    if beside > line.beside * on:
        return 0
    longest = np.ceil(np.sqrt(1 + line.rise * line.rise) * line.reach) + 2
    pieces = np.zeros(2 * int(longest) + 1, np.bool_)
    for k in range(len(x)):
        dx, dy, dz = x[k] - mx, y[k] - my, z[k] - mz
        along = dx * ux + dy * uy + dz * uz
        if dx * dx + dy * dy + dz * dz - along * along <= line.thick**2:
            pieces[int(np.floor(along + longest + 0.5))] = True
    return pieces.sum()
