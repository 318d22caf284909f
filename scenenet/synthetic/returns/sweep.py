"""The way of all pulses of some scan lines, compiled."""

from __future__ import annotations

import numba
import numpy as np

from scenenet.synthetic.codes import (
    BARE,
    BARE_TOO,
    GRASS,
    GROUND,
    LOW,
    SCRUB,
    STRAY,
    TALL,
    TALL_M,
    TREE,
    UNCLASSIFIED,
    WATER,
)
from scenenet.synthetic.returns.pulse import (
    BORDER_M,
    CEILING_CELL_M,
    FOLIAGE,
    FOLIAGE_CELL_M,
    GOES_ON,
    GRASS_M,
    MOST_RETURNS,
    STEP_M,
    WATER_RETURNS,
)
from scenenet.synthetic.scene.hashing import next_state, uniform


@numba.njit(nogil=True, cache=True, inline="always")
def _elevation(ground, i, j, x, y):  # type: ignore[no-untyped-def]
    """Bilinear elevation at (x, y) of a raster with a step of 1 m."""
    column, row = np.floor(x), np.floor(y)
    u, v = x - column, y - row
    c, r = int(column) - i, int(row) - j
    c, r = min(max(c, 0), ground.shape[1] - 2), min(max(r, 0), ground.shape[0] - 2)
    low = ground[r, c] + (ground[r, c + 1] - ground[r, c]) * u
    high = ground[r + 1, c] + (ground[r + 1, c + 1] - ground[r + 1, c]) * u
    return low + (high - low) * v


@numba.njit(nogil=True, cache=True)
def sweep(  # type: ignore[no-untyped-def]
    first, last, pulses, seed, frame, path, ground, gi, gj, crowns, depths,
    vi, vj, cell, ceiling, ci, cj, foliage, hit, grass, tallness, rise, water,
    oi, oj, cover_cell, noise, marked, xyz, code,
):  # fmt: skip
    """Pulses of the scan lines ``first`` to ``last``; returns the number of points written."""
    x0, y0, cos, sin, low, high, k0, k1, half_width = frame
    s0, t0, line_step, pulse_step, skew, sway, offset, height = path
    mask = FOLIAGE - 1
    fz, fy, fx = 1 / FOLIAGE_CELL_M[0], 1 / FOLIAGE_CELL_M[1], 1 / FOLIAGE_CELL_M[2]
    rows, columns = crowns.shape[:2]
    per_cell, per_ceiling, per_cover = 1.0 / cell, 1.0 / CEILING_CELL_M, 1.0 / cover_cell
    first_s, last_s = low - abs(k0) * half_width, high + abs(k1) * half_width
    n = 0
    for line in range(first, last):
        shift = sway * (np.sin(0.31 * line) + 0.6 * np.sin(0.093 * line + 1.0))
        start = 0.5 * (line % 2)
        for pulse in range(pulses):
            state = seed ^ (np.uint64(line * pulses + pulse) * np.uint64(0xD1342543DE82EF95))
            state = next_state(state)
            r0 = uniform(state)
            state = next_state(state)
            r1 = uniform(state)
            t = t0 + (pulse + start + 0.22 * (r0 - 0.5)) * pulse_step
            s = s0 + (line + 0.16 * (r1 - 0.5)) * line_step + skew * t + shift
            if s < first_s or s >= last_s:
                continue  # A pulse leans across, not along: it stays outside.
            x, y = x0 + s * cos - t * sin, y0 + s * sin + t * cos
            up = ceiling[
                min(max(int(np.floor(y * per_ceiling)) - cj, 0), ceiling.shape[0] - 1),
                min(max(int(np.floor(x * per_ceiling)) - ci, 0), ceiling.shape[1] - 1),
            ]
            outside = abs(t) > half_width or s < low + t * k0 or s >= high + t * k1
            lean = (offset - t) / height
            if outside and abs(t) - half_width >= abs(lean) * up:
                continue
            z = _elevation(ground, gi, gj, x, y)
            returns = 0
            ended = False
            if up > 0:
                state = next_state(state)
                to_sample = STEP_M * uniform(state)
                # The pulse stays over one cell of the canopy for so much of its way down.
                over_cell = cell / max(abs(lean), 0.01)
                h0 = up
                while h0 > 0 and not ended:
                    h1 = max(h0 - over_cell, 0.0)
                    tt = t + lean * 0.5 * (h0 + h1)
                    px, py = x0 + s * cos - tt * sin, y0 + s * sin + tt * cos
                    c = int(np.floor(px * per_cell + 0.5)) - vi
                    r = int(np.floor(py * per_cell + 0.5)) - vj
                    above, h0 = h0, h1
                    if c < 0 or r < 0 or c >= columns or r >= rows:
                        continue
                    top, bottom, roof = (
                        crowns[r, c, 0] - z,
                        crowns[r, c, 1] - z,
                        crowns[r, c, 2] - z,
                    )
                    solid = roof >= h1
                    if not solid and (top <= h1 or bottom >= above):
                        continue
                    inside = (
                        abs(tt) <= half_width - 0.5 * cell
                        and s >= low + tt * k0
                        and s < high + tt * k1
                    )
                    leaf = min(hit * crowns[r, c, 3], 0.9)
                    h = min(above, roof) if solid else min(above, top) - to_sample
                    end = max(h1, bottom)
                    while solid or h > end:
                        pz = z + h
                        if not solid:
                            h -= STEP_M
                            full = foliage[
                                int(np.floor(pz * fz)) & mask,
                                int(np.floor(py * fy)) & mask,
                                int(np.floor(px * fx)) & mask,
                            ]
                            if not full:
                                continue
                            state = next_state(state)
                            if uniform(state) > leaf:
                                continue
                        if inside:
                            state = next_state(state)
                            draw = uniform(state)
                            state = next_state(state)
                            jitter = 2.0 * (uniform(state) - 0.5)
                            rise_here = pz - _elevation(ground, gi, gj, px, py)
                            pz += noise * jitter if solid else 0.5 * STEP_M * jitter
                            on = t + lean * (pz - z)
                            xyz[n, 0] = x0 + s * cos - on * sin
                            xyz[n, 1] = y0 + s * sin + on * cos
                            xyz[n, 2] = pz
                            # Mostly tall; strays deep in the crowns, unclassified at the border.
                            if rise_here < TALL_M:
                                code[n] = LOW if draw > 0.006 else SCRUB
                            elif abs(tt) > half_width - BORDER_M and draw < 0.6:
                                code[n] = UNCLASSIFIED
                            elif draw < 0.068:
                                code[n] = TREE
                            elif (
                                not solid
                                and draw > 1 - 0.02 * depths * (1 - rise_here / (up + 1.0)) ** 2
                            ):
                                code[n] = STRAY
                            else:
                                code[n] = TALL
                            n += 1
                        returns += 1
                        state = next_state(state)
                        if solid or returns >= MOST_RETURNS or uniform(state) > GOES_ON:
                            ended = True
                            break
                    if not solid:
                        to_sample = max(end - h, 0.0)
            if ended or outside:
                continue
            c = min(max(int(np.floor(x * per_cover + 0.5)) - oi, 0), grass.shape[1] - 1)
            r = min(max(int(np.floor(y * per_cover + 0.5)) - oj, 0), grass.shape[0] - 1)
            state = next_state(state)
            draw = uniform(state)
            state = next_state(state)
            error = uniform(state)
            state = next_state(state)
            error += uniform(state)
            state = next_state(state)
            error = 2.0 * noise * (error + uniform(state) - 1.5)
            # Key points: the first return of its kind in a cell, drawn by lot.
            state = next_state(state)
            lot = uniform(state)
            kr = min(max(int(np.floor(y)) - gj, 0), marked.shape[1] - 1)
            kc = min(max(int(np.floor(x)) - gi, 0), marked.shape[2] - 1)
            if water[r, c] > 0:
                if draw > WATER_RETURNS:
                    continue
                grown, code[n] = 0.0, WATER
            elif draw < grass[r, c]:
                state = next_state(state)
                grown = -tallness[r, c] * np.log(1.0 - uniform(state))
                if grown > TALL_M:
                    grown = TALL_M * draw / grass[r, c]
                kind = 1 if grown < GRASS_M else 2
                code[n] = LOW
                if lot < (0.12 if kind == 1 else 0.06) and not marked[kind, kr, kc]:
                    marked[kind, kr, kc] = True
                    code[n] = GRASS if kind == 1 else SCRUB
            else:
                grown = rise[r, c]
                # The lower ones of the returns of the ground are those in 19.
                code[n] = BARE_TOO if draw + 6.0 * error > 0.74 + 0.26 * grass[r, c] else BARE
                if lot < 0.12 and not marked[0, kr, kc]:
                    marked[0, kr, kc] = True
                    code[n] = GROUND
            xyz[n, 0], xyz[n, 1], xyz[n, 2] = x, y, z + grown + error
            n += 1
    return n
