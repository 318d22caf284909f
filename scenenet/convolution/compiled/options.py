"""How the loops are compiled."""

from __future__ import annotations

import numba

from scenenet.core.compilation import COMPILED

TASKS = 16
"""Parts that a batch is cut into for the cores to share. It is a constant, and not the number of
cores, because a sum over parts must not depend on the machine's cores."""


@numba.njit(**COMPILED)
def first_plane(task):  # pragma: no cover - compiled
    """The first plane of a part; the others follow TASKS apart.

    A core takes neighbouring parts, and most points lie in a few neighbouring planes, near the
    ground. So neighbouring planes go to parts that are far apart: by the bits of their number in
    reverse, which shares them out evenly among any number of cores.
    """
    return (task & 1) << 3 | (task & 2) << 1 | (task & 4) >> 1 | (task & 8) >> 3
