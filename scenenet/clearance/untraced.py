"""Wires of a span that were not traced, among the points that a model takes for wires.

They are not obstacles. A twig beside a conductor and the jib of a crane are, though a model may
take them for wires too. A wire runs along the whole span, and they do not.
"""

from __future__ import annotations

import numpy as np

LANE_M = 1.0
"""m, width of a lane along the span. A wire may be on the border of two."""

STEP_M, RUN_STEPS = 1.0, 30
"""m, length of a step along a lane, and number of steps that a wire is followed."""

SEEN = 0.5
"""Smallest share of these steps with a point of a wire: a scanner misses some."""


def untraced(stz: np.ndarray) -> np.ndarray:
    """(n,) bool: which points (n, 3) m, in the frame of a span, are on wires along it.

    Args:
        stz: points that a model takes for wires, and that are on no traced one.
    """
    from scipy.ndimage import maximum_filter1d

    if not len(stz):
        return np.zeros(0, bool)
    step = np.floor(stz[:, 0] / STEP_M).astype(int)
    lane = np.floor(stz[:, 1] / LANE_M).astype(int)
    step, lane = step - step.min(), lane - lane.min()
    seen = np.zeros((lane.max() + 1, step.max() + RUN_STEPS), np.int32)
    seen[lane, step] = 1
    seen = maximum_filter1d(seen, 3, axis=0, mode="constant")
    # The number of steps with a point in the run that begins at each step.
    total = np.pad(np.cumsum(seen, axis=1), ((0, 0), (1, 0)))
    run = total[:, RUN_STEPS:] - total[:, :-RUN_STEPS]
    # The runs that have a step begin at it or less than a run before it.
    before = np.pad(run, ((0, 0), (RUN_STEPS - 1, 0)))
    best = np.lib.stride_tricks.sliding_window_view(before, RUN_STEPS, axis=1).max(axis=2)
    return np.asarray(best[lane, step] >= SEEN * RUN_STEPS)
