"""Ids of towers, which follow from where the towers stand.

A tower keeps its id when its survey is cut elsewhere, when tiles are added, and when its tile is
predicted alone. A number in the order of a list would change with each of these. Spans are numbered
in the same way, by their middles.
"""

from __future__ import annotations

import numpy as np

CELL_M = 10.0
"""m, edge of the cells that ids name."""

EAST, NORTH = 40_000, 100_000
"""Cells after which the part of an id for x, and the part for y, begin again: 400 km and 1000 km.
The largest id, 3 999 999 999, fits into the 32 bits of the dimension ``tower_id``."""

SHIFT_M = 1 / 3
"""m from the borders of the cells to whole multiples of ``CELL_M``. Towers are planned at round
coordinates; on a border, a millimetre would decide the id."""


def tower_ids(places: np.ndarray) -> list[int]:
    """The id of each tower at ``places`` (n, 2), x and y in m; all differ, and none is 0.

    The last five digits are y in steps of 10 m, modulo 1000 km. The digits before them are x in
    steps of 10 m, modulo 400 km. If several towers have the same digits, the one furthest to the
    south-west gets them, and each of the others gets the next free number. So an id depends only on
    towers within a few cells, or a whole period away.

    Raises:
        ValueError: a coordinate is not finite.
    """
    if not np.isfinite(places).all():
        raise ValueError("the places of towers must be finite")
    cells = np.floor((places + SHIFT_M) / CELL_M).astype(np.int64) % (EAST, NORTH)
    wanted = (cells[:, 0] * NORTH + cells[:, 1]).tolist()
    # Poles of a portal often share x or y to the millimetre, and hardly ever the sum of both.
    order = np.lexsort((places[:, 0], places.sum(axis=1))).tolist()
    ids = [0] * len(wanted)
    taken, displaced = {0}, []
    for row in order:
        if wanted[row] in taken:
            displaced.append(row)
        else:
            taken.add(wanted[row])
            ids[row] = wanted[row]
    for row in displaced:
        free = wanted[row]
        while free in taken:
            free = (free + 1) % (EAST * NORTH)
        taken.add(free)
        ids[row] = free
    return ids
