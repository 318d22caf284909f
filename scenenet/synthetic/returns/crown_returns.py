"""Returns from crowns, roofs and walls on the way of a pulse down, compiled."""

from __future__ import annotations

import numba
import numpy as np

from scenenet.synthetic.codes import LOW, SCRUB, STRAY, TALL, TALL_M, TREE, UNCLASSIFIED
from scenenet.synthetic.returns.ground_returns import elevation
from scenenet.synthetic.returns.pulse import (
    BORDER_M,
    FOLIAGE,
    FOLIAGE_CELL_M,
    GOES_ON,
    MOST_RETURNS,
    STEP_M,
)
from scenenet.synthetic.returns.records import LOOP, Crossing
from scenenet.synthetic.scene.hashing import next_state, uniform

MASK = FOLIAGE - 1
PER_Z, PER_Y, PER_X = (1 / side for side in FOLIAGE_CELL_M)


@numba.njit(inline="always", **LOOP)
def through_crowns(scene, frame, pulse, out, n, state):  # type: ignore[no-untyped-def]
    """Follow a pulse down through everything above the ground.

    Args:
        n: number of returns written so far.
        state: uint64, of the random sequence of this pulse.

    Returns:
        n and state afterwards, and whether the pulse ended before it reached the ground.
    """
    crowns = scene.crowns
    rows, columns = crowns.values.shape[:2]
    per_cell = 1.0 / crowns.step
    state = next_state(state)
    to_sample = STEP_M * uniform(state)
    # The pulse stays over one cell of the canopy for this part of its way down.
    over_cell = crowns.step / max(abs(pulse.lean), 0.01)
    returns = 0
    height = pulse.up
    while height > 0:
        above, height = height, max(height - over_cell, 0.0)
        t = pulse.t + pulse.lean * 0.5 * (above + height)
        x = frame.x + pulse.s * frame.cos - t * frame.sin
        y = frame.y + pulse.s * frame.sin + t * frame.cos
        c = int(np.floor(x * per_cell + 0.5)) - crowns.i
        r = int(np.floor(y * per_cell + 0.5)) - crowns.j
        if c < 0 or r < 0 or c >= columns or r >= rows:
            continue
        top, bottom = crowns.values[r, c, 0] - pulse.z, crowns.values[r, c, 1] - pulse.z
        roof = crowns.values[r, c, 2] - pulse.z
        solid = roof >= height
        if not solid and (top <= height or bottom >= above):
            continue
        inside = (
            abs(t) <= frame.half_width - 0.5 * crowns.step
            and pulse.s >= frame.low + t * frame.k0
            and pulse.s < frame.high + t * frame.k1
        )
        leaf = min(scene.hit * crowns.values[r, c, 3], 0.9)
        start = min(above, roof) if solid else min(above, top) - to_sample
        crossing = Crossing(t, x, y, start, max(height, bottom), solid, inside, leaf)
        n, state, returns, ended, to_sample = _cross(
            scene, frame, pulse, crossing, out, n, state, returns
        )
        if ended:
            return n, state, True
    return n, state, False


@numba.njit(inline="always", **LOOP)
def _cross(scene, frame, pulse, crossing, out, n, state, returns):  # type: ignore[no-untyped-def]
    """Follow a pulse over one cell; returns n, state, the returns of the pulse so far, whether it
    ended, and the way to its next step in the cell below."""
    h = crossing.start
    while crossing.solid or h > crossing.end:
        z = pulse.z + h
        if not crossing.solid:
            h -= STEP_M
            full = scene.foliage[
                int(np.floor(z * PER_Z)) & MASK,
                int(np.floor(crossing.y * PER_Y)) & MASK,
                int(np.floor(crossing.x * PER_X)) & MASK,
            ]
            if not full:
                continue
            state = next_state(state)
            if uniform(state) > crossing.leaf:
                continue
        if crossing.inside:
            state = next_state(state)
            draw = uniform(state)
            state = next_state(state)
            jitter = 2.0 * (uniform(state) - 0.5)
            rise = z - elevation(scene.ground, crossing.x, crossing.y)
            z += scene.noise * jitter if crossing.solid else 0.5 * STEP_M * jitter
            t = pulse.t + pulse.lean * (z - pulse.z)
            out.xyz[n, 0] = frame.x + pulse.s * frame.cos - t * frame.sin
            out.xyz[n, 1] = frame.y + pulse.s * frame.sin + t * frame.cos
            out.xyz[n, 2] = z
            stray = 0.02 * scene.depths * (1 - rise / (pulse.up + 1.0)) ** 2
            at_border = abs(crossing.t) > frame.half_width - BORDER_M
            out.code[n] = _code(rise, at_border, crossing.solid, stray, draw)
            n += 1
        returns += 1
        state = next_state(state)
        if crossing.solid or returns >= MOST_RETURNS or uniform(state) > GOES_ON:
            return n, state, returns, True, 0.0
    return n, state, returns, False, max(crossing.end - h, 0.0)


@numba.njit(**LOOP)
def _code(rise, at_border, solid, stray, draw):  # type: ignore[no-untyped-def]
    """Class code of a return ``rise`` metres above the ground: mostly tall; deep in the crowns
    stray with probability ``stray``, at the border of the strip unclassified."""
    if rise < TALL_M:
        return LOW if draw > 0.006 else SCRUB
    if at_border and draw < 0.6:
        return UNCLASSIFIED
    if draw < 0.068:
        return TREE
    if not solid and draw > 1 - stray:
        return STRAY
    return TALL
