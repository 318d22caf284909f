"""Returns from the ground and from what grows on it, compiled."""

from __future__ import annotations

import numba
import numpy as np

from scenenet.synthetic.codes import BARE, BARE_TOO, GRASS, GROUND, LOW, SCRUB, TALL_M, WATER
from scenenet.synthetic.returns.pulse import GRASS_M, WATER_RETURNS
from scenenet.synthetic.returns.records import LOOP
from scenenet.synthetic.scene.hashing import next_state, uniform

GROUND_KEY, GRASS_KEY, SCRUB_KEY = 0, 1, 2
"""First index of ``Returns.marked``."""


@numba.njit(inline="always", **LOOP)
def elevation(ground, x, y):  # type: ignore[no-untyped-def]
    """Bilinear elevation at (x, y), m, of a ``Grid`` with a step of 1 m."""
    column, row = np.floor(x), np.floor(y)
    u, v = x - column, y - row
    values = ground.values
    c, r = int(column) - ground.i, int(row) - ground.j
    c, r = min(max(c, 0), values.shape[1] - 2), min(max(r, 0), values.shape[0] - 2)
    low = values[r, c] + (values[r, c + 1] - values[r, c]) * u
    high = values[r + 1, c] + (values[r + 1, c + 1] - values[r + 1, c]) * u
    return low + (high - low) * v


@numba.njit(inline="always", **LOOP)
def ground_return(scene, pulse, out, n, state):  # type: ignore[no-untyped-def]
    """Write the return of a pulse that reached the ground; returns the number of returns.

    Key points, which get a class of their own, are the first of their kind in a cell of 1 m for
    which a random draw says so.
    """
    cover, ground, marked = scene.cover, scene.ground, out.marked
    per_cover = 1.0 / cover.step
    grass = cover.grass
    c = min(max(int(np.floor(pulse.x * per_cover + 0.5)) - cover.i, 0), grass.shape[1] - 1)
    r = min(max(int(np.floor(pulse.y * per_cover + 0.5)) - cover.j, 0), grass.shape[0] - 1)
    state = next_state(state)
    draw = uniform(state)
    state = next_state(state)
    error = uniform(state)
    state = next_state(state)
    error += uniform(state)
    state = next_state(state)
    error = 2.0 * scene.noise * (error + uniform(state) - 1.5)
    state = next_state(state)
    lot = uniform(state)
    kr = min(max(int(np.floor(pulse.y)) - ground.j, 0), marked.shape[1] - 1)
    kc = min(max(int(np.floor(pulse.x)) - ground.i, 0), marked.shape[2] - 1)
    if cover.water[r, c] > 0:
        if draw > WATER_RETURNS:
            return n
        grown, out.code[n] = 0.0, WATER
    elif draw < grass[r, c]:
        state = next_state(state)
        grown = -cover.tallness[r, c] * np.log(1.0 - uniform(state))
        if grown > TALL_M:
            grown = TALL_M * draw / grass[r, c]
        kind = GRASS_KEY if grown < GRASS_M else SCRUB_KEY
        out.code[n] = LOW
        share = scene.key_points if kind == GRASS_KEY else 0.5 * scene.key_points
        if lot < share and not marked[kind, kr, kc]:
            marked[kind, kr, kc] = True
            out.code[n] = GRASS if kind == GRASS_KEY else SCRUB
    else:
        grown = cover.rise[r, c]
        # Class 19 holds the lower returns of the ground.
        higher = 1.0 - scene.lower_ground * (1.0 - grass[r, c])
        out.code[n] = BARE_TOO if draw + 6.0 * error > higher else BARE
        if lot < scene.key_points and not marked[GROUND_KEY, kr, kc]:
            marked[GROUND_KEY, kr, kc] = True
            out.code[n] = GROUND
    out.xyz[n, 0], out.xyz[n, 1], out.xyz[n, 2] = pulse.x, pulse.y, pulse.z + grown + error
    return n + 1
