"""The shape of crowns, compiled."""

from __future__ import annotations

import numba
import numpy as np


@numba.njit(nogil=True, cache=True)
def paint(top, bottom, i, j, step, texture, xs, ys, heights, radii, lows, conifers):  # type: ignore[no-untyped-def]
    """Raise the canopy where a plant is higher than the canopy there.

    Args:
        top, bottom, texture: (rows, columns) values of rasters with first node (i, j) and nodes
            ``step`` metres apart; top and bottom are changed, m.
        xs, ys, heights, radii, lows, conifers: (P,) columns of ``Plants``.
    """
    rows, columns = top.shape
    for k in range(len(xs)):
        x, y, height, radius, low = xs[k], ys[k], heights[k], radii[k], lows[k]
        depth = height - low
        c0 = max(int(np.ceil((x - radius) / step)) - i, 0)
        c1 = min(int(np.floor((x + radius) / step)) - i + 1, columns)
        r0 = max(int(np.ceil((y - radius) / step)) - j, 0)
        r1 = min(int(np.floor((y + radius) / step)) - j + 1, rows)
        for r in range(r0, r1):
            dy = (r + j) * step - y
            for c in range(c0, c1):
                dx = (c + i) * step - x
                share = (dx * dx + dy * dy) / (radius * radius) * texture[r, c]
                if share >= 1:
                    continue
                if conifers[k]:
                    crown, under = low + depth * (1 - np.sqrt(share)), low
                else:
                    dome = np.sqrt(1 - share)
                    crown = low + depth * (0.4 + 0.6 * dome)
                    under = low + 0.4 * depth * (1 - dome)
                if crown > top[r, c]:
                    top[r, c], bottom[r, c] = crown, under
