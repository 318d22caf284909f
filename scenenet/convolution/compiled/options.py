"""How the compiled loops divide a batch among the cores."""

from __future__ import annotations

import numba

from scenenet.core.compilation import COMPILED

TASKS = 16
"""Number of parts that a batch is divided into. It is a constant, and not the number of cores,
because a sum over parts must not depend on the machine."""


@numba.njit(**COMPILED)
def first_plane(task):  # pragma: no cover - compiled
    """The first plane of a part; its next planes follow in steps of ``TASKS``.

    A core takes neighbouring parts, and most points lie in a few neighbouring planes near the
    ground. Neighbouring planes therefore go to distant parts: the order reverses the bits of the
    part's number, which balances any number of cores.
    """
    return (task & 1) << 3 | (task & 2) << 1 | (task & 4) >> 1 | (task & 8) >> 3
