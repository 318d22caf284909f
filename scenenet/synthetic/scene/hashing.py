"""Random numbers and noise as functions of place and seed, compiled.

Imported only inside functions, so that reading settings does not load the compiler.
"""

from __future__ import annotations

import numba
import numpy as np

_X = np.uint64(0x9E3779B97F4A7C15)
_Y = np.uint64(0xC2B2AE3D27D4EB4F)
_MIX = np.uint64(0xBF58476D1CE4E5B9)
_MIX2 = np.uint64(0x94D049BB133111EB)
_STEP = np.uint64(0x9E3779B97F4A7C15)


@numba.njit(nogil=True, cache=True, inline="always")
def next_state(state):  # type: ignore[no-untyped-def]
    """The state (uint64) after ``state`` of a random sequence."""
    return state + _STEP


@numba.njit(nogil=True, cache=True, inline="always")
def uniform(state):  # type: ignore[no-untyped-def]
    """The number in [0, 1) for ``state`` (uint64); splitmix64."""
    value = state
    value ^= value >> np.uint64(30)
    value *= _MIX
    value ^= value >> np.uint64(27)
    value *= _MIX2
    value ^= value >> np.uint64(31)
    return (value >> np.uint64(11)) * 2.0**-53


@numba.njit(nogil=True, cache=True, inline="always")
def _node(i, j, seed):  # type: ignore[no-untyped-def]
    """Number in [0, 1) of the node (i, j), int64; neighbouring nodes are unrelated."""
    return uniform((np.uint64(i) * _X + np.uint64(j) * _Y) ^ seed)


@numba.njit(nogil=True, cache=True)
def hash_nodes(i, j, seed):  # type: ignore[no-untyped-def]
    """A number in [0, 1) for each node (i, j), both (N,) int64; seed is uint64."""
    out = np.empty(len(i))
    for k in range(len(i)):
        out[k] = _node(i[k], j[k], seed)
    return out


@numba.njit(nogil=True, cache=True)
def noise_at(x, y, wavelength, seed):  # type: ignore[no-untyped-def]
    """``random_fields.value_noise`` at places (N,); seed is uint64."""
    out = np.empty(len(x))
    i, j = np.int64(0), np.int64(0)
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    known = False
    for k in range(len(x)):
        u, v = x[k] / wavelength, y[k] / wavelength
        column, row = np.int64(np.floor(u)), np.int64(np.floor(v))
        # Places are in rows, so the nodes around one are mostly those of the previous one.
        if not known or column != i or row != j:
            i, j, known = column, row, True
            a, b = _node(i, j, seed), _node(i + 1, j, seed)
            c, d = _node(i, j + 1, seed), _node(i + 1, j + 1, seed)
        u, v = u - i, v - j
        # Quintic steps, whose first and second derivatives vanish at both ends: no creases.
        u = u * u * u * (u * (u * 6.0 - 15.0) + 10.0)
        v = v * v * v * (v * (v * 6.0 - 15.0) + 10.0)
        low, high = a + (b - a) * u, c + (d - c) * u
        out[k] = 2.0 * (low + (high - low) * v) - 1.0
    return out
