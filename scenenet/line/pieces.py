"""Short straight pieces of wires among the points of a span."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

WINDOW_M, SHORTEST_WINDOW_M, WINDOWS = 12.0, 4.0, 4
"""m, length of a piece: a wire of a parameter of 300 m bends by 6 cm over it. In a short stretch of
wires pieces are shorter, so that it has so many, but not shorter than the second number."""

APART_M = 0.5
"""m, least distance between two wires that are told apart. Subconductors of a bundle are 0.3 to
0.5 m apart, conductors 0.8 m or more."""

STEEPEST = 0.5
"""Greatest rise of a wire per metre along the span, also of one on a steep slope."""

MIN_POINTS = 3
MIN_SHARE = 0.3
"""Points of a piece, and share of the window that they reach over, at least."""

SEEN_M = 0.05
"""m, to which positions are rounded where wires are told apart."""

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


def find_pieces(stz: np.ndarray, length: float = WINDOW_M) -> Pieces:
    """The pieces of ``length`` m among points (n, 3) m in the frame of a span. Windows overlap by
    half."""
    middles, slopes, weights, windows, members = [], [], [], [], []
    order = np.argsort(stz[:, 0], kind="stable")
    s = stz[order, 0]
    if len(s) == 0:
        return Pieces(np.empty((0, 3)), np.empty((0, 2)), np.empty(0), np.empty(0, int), [])
    step = length / 2
    first, last = int(np.floor(s[0] / step)) - 1, int(np.floor(s[-1] / step))
    for window in range(first, last + 1):
        low, high = np.searchsorted(s, [window * step, window * step + length])
        rows = order[low:high]
        if len(rows) < MIN_POINTS:
            continue
        for group in _groups(stz[rows], (window + 1) * step):
            own = rows[group]
            reach = np.ptp(stz[own, 0])
            if len(own) < MIN_POINTS or reach < MIN_SHARE * length:
                continue
            middle, slope, spread = _straight(stz[own])
            if abs(slope[1]) > STEEPEST or spread > THICKEST_M:
                continue
            middles.append(middle)
            slopes.append(slope)
            weights.append(reach)
            windows.append(window)
            members.append(own)
    return Pieces(
        np.array(middles).reshape(-1, 3),
        np.array(slopes).reshape(-1, 2),
        np.array(weights),
        np.array(windows, int),
        members,
    )


def _groups(stz: np.ndarray, middle: float) -> list[np.ndarray]:
    """Rows of the points of each wire in a window: they are close together when seen along their
    common slope."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    s, t, z = stz[:, 0] - middle, stz[:, 1], stz[:, 2]
    gradient = _gradient(s, t, z)
    seen = np.rint(np.column_stack((t, z - gradient * s)) / SEEN_M).astype(np.int64)
    cells, of = np.unique(seen, axis=0, return_inverse=True)
    pairs = cKDTree(cells).query_pairs(APART_M / SEEN_M, output_type="ndarray")
    links = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(len(cells),) * 2)
    label = connected_components(links, directed=False)[1][of.ravel()]
    order = np.argsort(label, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(label[order])) + 1)


def _gradient(s: np.ndarray, t: np.ndarray, z: np.ndarray) -> float:
    """Common rise of the wires in a window per metre: points of one wire fall into one cell only
    where they are seen along it."""
    few = slice(None, None, -(-len(s) // SAMPLE))
    level = z[few, None] - s[few, None] * GRADIENTS
    cell = APART_M / 2
    keys = np.floor(t[few, None] / cell).astype(np.int64) * 613
    keys = (keys + np.floor(level / cell).astype(np.int64)) % HASHED
    keys += np.arange(len(GRADIENTS)) * HASHED
    counts = np.bincount(keys.ravel(), minlength=HASHED * len(GRADIENTS))
    return float(GRADIENTS[np.argmax((counts.reshape(-1, HASHED) ** 2).sum(axis=1))])


def _straight(stz: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Middle (3,) m and slopes (2,) of the straight line through points (n, 3) m, and their root
    mean square distance from it, m."""
    middle = stz.mean(axis=0)
    offset = stz - middle
    ds = offset[:, 0]
    slopes = ds @ offset[:, 1:] / (ds @ ds)
    beside = offset[:, 1:] - ds[:, None] * slopes
    return middle, slopes, float(np.sqrt((beside**2).sum(axis=1).mean()))
