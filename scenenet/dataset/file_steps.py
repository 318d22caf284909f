"""Coordinates as whole steps of the file that they came from, to the last bit.

A LAS file stores coordinates as whole steps of a millimetre or a centimetre. As float64 each has 52
bits that look random to a compressor. Steps from point to point take a quarter of the space.
"""

from __future__ import annotations

from typing import Any

import numpy as np

STEPS_M = (0.01, 0.001, 0.0001)
"""Steps that are tried, m, from the largest."""

MOST_STEPS = 2**29
"""Steps that an extent may have, so that a difference of two places fits into 32 bits."""


def pack(values: np.ndarray) -> tuple[dict[str, np.ndarray], dict[str, Any]] | None:
    """Coordinates (N, C) as steps; None where they are not steps of ``STEPS_M``.

    Returns:
        ``steps`` (C, N) uint32, the difference in steps to the point before, with its sign in the
        last bit, and ``rest`` (C, N) int8 or int16, by how many representable numbers a coordinate
        differs from its product, mostly -1, 0 or 1; and ``step`` and ``low`` to unpack them.
    """
    if values.dtype != np.float64 or values.ndim != 2 or not len(values):
        return None
    if not np.isfinite(values).all():
        return None
    axes = np.ascontiguousarray(values.T)
    for step in STEPS_M:
        # From 0 where that is near enough: products with a step are then exact more often.
        near = np.abs(axes).max(axis=1, keepdims=True) < MOST_STEPS * step
        low = np.where(near, 0.0, np.floor(axes.min(axis=1, keepdims=True)))
        whole = np.rint((axes - low) / step)
        if np.abs(whole).max() >= MOST_STEPS:
            return None
        rest = axes.view(np.int64) - (whole * step + low).view(np.int64)
        size = np.min_scalar_type(-int(np.abs(rest).max()) - 1)
        if size.itemsize > np.dtype(np.int16).itemsize:
            continue
        places = whole.astype(np.int32)
        change = places.copy()
        change[:, 1:] -= places[:, :-1]
        steps = ((change << 1) ^ (change >> 31)).view(np.uint32)
        return {"steps": steps, "rest": rest.astype(size)}, {
            "step": step,
            "low": low[:, 0].tolist(),
        }
    return None


def unpack(arrays: dict[str, np.ndarray], facts: dict[str, Any]) -> np.ndarray:
    """The coordinates (N, C) float64 that ``pack`` packed."""
    steps = arrays["steps"]
    change = (steps >> 1).astype(np.int32) ^ -(steps & 1).astype(np.int32)
    whole = np.cumsum(change, axis=1, dtype=np.int64).astype(np.float64)
    near = whole * facts["step"] + np.array(facts["low"])[:, None]
    exact = (near.view(np.int64) + arrays["rest"]).view(np.float64)
    return np.ascontiguousarray(exact.T)
