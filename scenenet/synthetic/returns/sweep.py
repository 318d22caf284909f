"""Every pulse of some scan lines, from the scanner to its returns, compiled."""

from __future__ import annotations

import numba
import numpy as np

from scenenet.synthetic.returns.crown_returns import through_crowns
from scenenet.synthetic.returns.ground_returns import elevation, ground_return
from scenenet.synthetic.returns.records import LOOP, Pulse
from scenenet.synthetic.scene.hashing import next_state, uniform


@numba.njit(**LOOP)
def sweep(first, last, pulses, seed, frame, lines, scene, out):  # type: ignore[no-untyped-def]
    """Send the pulses of the scan lines ``first`` to ``last`` (exclusive).

    Args:
        pulses: of one scan line.
        seed: uint64, of these scan lines.
        frame: ``Frame`` of the strip.
        lines: ``ScanLines`` of the flight.
        scene: ``Scene`` that the pulses can meet.
        out: ``Returns`` to write to, from the first on.

    Returns:
        the number of returns.
    """
    first_s = frame.low - abs(frame.k0) * frame.half_width
    last_s = frame.high + abs(frame.k1) * frame.half_width
    n = 0
    for line in range(first, last):
        shift = lines.sway * (np.sin(0.31 * line) + 0.6 * np.sin(0.093 * line + 1.0))
        start = 0.5 * (line % 2)
        for number in range(pulses):
            state = seed ^ (np.uint64(line * pulses + number) * np.uint64(0xD1342543DE82EF95))
            state = next_state(state)
            r0 = uniform(state)
            state = next_state(state)
            r1 = uniform(state)
            t = lines.t + (number + start + 0.22 * (r0 - 0.5)) * lines.pulse_step
            s = lines.s + (line + 0.16 * (r1 - 0.5)) * lines.line_step + lines.skew * t + shift
            if s < first_s or s >= last_s:
                continue  # A pulse leans across the strip, not along it, so it stays outside.
            x = frame.x + s * frame.cos - t * frame.sin
            y = frame.y + s * frame.sin + t * frame.cos
            up = _ceiling(scene.ceiling, x, y)
            lean = (lines.offset - t) / lines.height
            outside = (
                abs(t) > frame.half_width
                or s < frame.low + t * frame.k0
                or s >= frame.high + t * frame.k1
            )
            if outside and abs(t) - frame.half_width >= abs(lean) * up:
                continue
            pulse = Pulse(s, t, x, y, elevation(scene.ground, x, y), lean, up)
            ended = False
            if up > 0:
                n, state, ended = through_crowns(scene, frame, pulse, out, n, state)
            if not ended and not outside:
                n = ground_return(scene, pulse, out, n, state)
    return n


@numba.njit(inline="always", **LOOP)
def _ceiling(ceiling, x, y):  # type: ignore[no-untyped-def]
    """Greatest height of anything above the ground near (x, y), m."""
    per_cell = 1.0 / ceiling.step
    row = min(max(int(np.floor(y * per_cell)) - ceiling.j, 0), ceiling.values.shape[0] - 1)
    column = min(max(int(np.floor(x * per_cell)) - ceiling.i, 0), ceiling.values.shape[1] - 1)
    return ceiling.values[row, column]
