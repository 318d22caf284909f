"""Short straight pieces of wires among the points of a span."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from scenenet.core.compilation import EXACT

WINDOW_M, SHORTEST_WINDOW_M, WINDOWS = 12.0, 2.5, 4
"""m, length of a piece: a wire of a parameter of 300 m bends by 6 cm over it. In a short stretch of
wires pieces are shorter, so that it has so many, but not shorter than the second number."""

APART_M = 0.5
"""m, least distance of two wires that are distinguished. Subconductors of a bundle are 0.3 to
0.5 m apart, conductors 0.8 m or more."""

STEEPEST = 0.5
"""Greatest rise of a wire per metre along the span, beyond that of the span itself."""

MIN_POINTS = 3
MIN_SHARE = 0.3
"""Points of a piece, and share of the window that they reach over, at least."""

SEEN_M = 0.05
"""m, to which positions are rounded to distinguish wires."""

SAMPLE, HASHED = 400, 4096
"""Points of a window that its slope is found from, at most, and cells that they are counted in."""

THICKEST_M = 0.35
"""m, root mean square distance of the points of a piece from a straight line, at most: that of a
bundle of four is 0.28 m, that of a branch or a crown is more."""

GRADIENTS = np.arange(-STEEPEST, STEEPEST + 1e-9, 0.02)


@dataclass(frozen=True)
class Pieces:
    """Straight pieces, each a row.

    Attributes:
        middle: (P, 3) m, s, t and z of the middle of each.
        slopes: (P, 2) change of t and of z per metre of s.
        weight: (P,) m, length along s that its points reach over.
        window: (P,) number of the window along s.
        members: rows of the points of each piece.
    """

    middle: np.ndarray
    slopes: np.ndarray
    weight: np.ndarray
    window: np.ndarray
    members: list[np.ndarray]

    def __len__(self) -> int:
        return len(self.middle)


def window_of(length: float) -> float:
    """m, length of the pieces of wires that are ``length`` m long."""
    return float(np.clip(length / WINDOWS, SHORTEST_WINDOW_M, WINDOW_M))


def find_pieces(stz: np.ndarray, length: float = WINDOW_M, rise: float = 0.0) -> Pieces:
    """The pieces of ``length`` m among points (n, 3) m in the frame of a span that rises by
    ``rise`` m per metre. Windows overlap by half."""
    order = np.argsort(stz[:, 0], kind="stable")
    if len(order) == 0:
        return Pieces(np.empty((0, 3)), np.empty((0, 2)), np.empty(0), np.empty(0, int), [])
    ordered = stz[order]
    step = length / 2
    first, last = (int(np.floor(ordered[end, 0] / step)) for end in (0, -1))
    windows = np.arange(first - 1, last + 1)
    lows = np.searchsorted(ordered[:, 0], windows * step)
    highs = np.searchsorted(ordered[:, 0], windows * step + length)
    gradients = rise + GRADIENTS
    middles, slopes, weights, numbers, members = [], [], [], [], []
    for window, low, high in zip(windows.tolist(), lows.tolist(), highs.tolist(), strict=True):
        if high - low < MIN_POINTS:
            continue
        points = ordered[low:high]
        gradient = gradients[_gradient((window + 1) * step, points, gradients)]
        rows, ends = _groups((window + 1) * step, points, gradient)
        lines = _straight(points, rows, ends)
        for number, (*middle, by_t, by_z, reach, spread) in enumerate(lines.tolist()):
            own = order[low + rows[ends[number] : ends[number + 1]]]
            if len(own) < MIN_POINTS or reach < MIN_SHARE * length:
                continue
            if abs(by_z - rise) > STEEPEST or spread > THICKEST_M:
                continue
            middles.append(middle)
            slopes.append((by_t, by_z))
            weights.append(reach)
            numbers.append(window)
            members.append(own)
    return Pieces(
        np.array(middles).reshape(-1, 3),
        np.array(slopes).reshape(-1, 2),
        np.array(weights),
        np.array(numbers, int),
        members,
    )


@numba.njit(**EXACT)
def _groups(middle, points, gradient):  # pragma: no cover - compiled
    """Rows (n,) of the points (n, 3) of each wire in a window, and where those of each begin and
    end: they are close together when seen along their common slope.

    Args:
        middle: m, s of the middle of the window.
        gradient: of ``_gradient``.
    """
    n = len(points)
    across, up = np.empty(n, np.int64), np.empty(n, np.int64)
    for i in range(n):
        s, t, z = points[i, 0] - middle, points[i, 1], points[i, 2]
        across[i], up[i] = np.rint(t / SEEN_M), np.rint((z - gradient * s) / SEEN_M)
    west, low, high = across[0], up[0], up[0]
    for i in range(n):
        west, low, high = min(west, across[i]), min(low, up[i]), max(high, up[i])
    key = np.empty(n, np.int64)
    for i in range(n):
        key[i] = (across[i] - west) * (high - low + 1) + (up[i] - low)
    order = np.argsort(key, kind="mergesort")
    cell_of = np.empty(n, np.int64)
    first = np.empty(n, np.int64)
    cells = 0
    for i in range(n):
        if i == 0 or key[order[i]] != key[order[i - 1]]:
            first[cells] = order[i]
            cells += 1
        cell_of[order[i]] = cells - 1
    near = APART_M / SEEN_M
    root = np.arange(cells)
    for i in range(cells):
        a, b = across[first[i]], up[first[i]]
        for j in range(i + 1, cells):
            da, db = across[first[j]] - a, up[first[j]] - b
            if da > near:
                break
            if da * da + db * db <= near * near:
                one, other = _root(root, i), _root(root, j)
                root[max(one, other)] = min(one, other)
    label = np.empty(cells, np.int64)
    count = 0
    for i in range(cells):
        if root[i] == i:
            label[i] = count
            count += 1
        else:
            label[i] = label[_root(root, i)]
    ends = np.zeros(count + 1, np.int64)
    for i in range(n):
        ends[label[cell_of[i]] + 1] += 1
    for group in range(count):
        ends[group + 1] += ends[group]
    at, rows = ends[:-1].copy(), np.empty(n, np.int64)
    for i in range(n):
        group = label[cell_of[i]]
        rows[at[group]] = i
        at[group] += 1
    return rows, ends


@numba.njit(**EXACT)
def _root(root, i):  # pragma: no cover - compiled
    """The first cell of the group of a cell; the way there becomes shorter."""
    while root[i] != i:
        root[i] = root[root[i]]
        i = root[i]
    return i


@numba.njit(**EXACT)
def _gradient(middle, points, gradients):  # pragma: no cover - compiled
    """Row in ``gradients`` of the common rise of the wires in a window per metre: points of one
    wire fall into one cell only where they are seen along it."""
    cell = APART_M / 2
    step = -(-len(points) // SAMPLE)
    best, most = 0, -1
    for k in range(len(gradients)):
        counts, squares = np.zeros(HASHED, np.int64), 0
        for i in range(0, len(points), step):
            s, t, z = points[i, 0] - middle, points[i, 1], points[i, 2]
            key = np.int64(np.floor(t / cell)) * 613
            key = (key + np.int64(np.floor((z - s * gradients[k]) / cell))) % HASHED
            squares += 2 * counts[key] + 1
            counts[key] += 1
        if squares > most:
            best, most = k, squares
    return best


@numba.njit(**EXACT)
def _straight(points, rows, ends):  # pragma: no cover - compiled
    """The straight line through each group of points, (G, 7): its middle, s, t and z in m, its
    slopes of t and z, how far the points reach along s, and their root mean square distance from
    it, m."""
    lines = np.zeros((len(ends) - 1, 7))
    for group in range(len(lines)):
        own = rows[ends[group] : ends[group + 1]]
        middle, slopes = lines[group, :3], lines[group, 3:5]
        low, high = np.inf, -np.inf
        for i in own:
            middle += points[i]
            low, high = min(low, points[i, 0]), max(high, points[i, 0])
        middle /= len(own)
        squared = 0.0
        for i in own:
            ds = points[i, 0] - middle[0]
            slopes += ds * (points[i, 1:] - middle[1:])
            squared += ds * ds
        slopes /= squared
        beside = 0.0
        for i in own:
            away = points[i, 1:] - middle[1:] - (points[i, 0] - middle[0]) * slopes
            beside += away[0] * away[0] + away[1] * away[1]
        lines[group, 5], lines[group, 6] = high - low, np.sqrt(beside / len(own))
    return lines
