"""Coordinates come back to the last bit, and take little space where they are steps of a file."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.dataset.file_steps import pack, unpack


def scanned(n: int, step: float, offset: list[float]) -> np.ndarray:
    """Coordinates (n, 3) as a LAS reader gives them: whole steps from an offset, rounded twice."""
    whole = np.random.default_rng(0).integers(-50_000, 50_000, (n, 3))
    return whole * step + np.array(offset)


@pytest.mark.parametrize("step", [0.01, 0.001, 0.0001])
@pytest.mark.parametrize("offset", [[545_000, 4_634_000, 0], [-8_238_310.25, 12.5, -3.75]])
def test_steps_of_a_file_come_back_bit_for_bit(step: float, offset: list[float]):
    xyz = scanned(5000, step, offset)
    packed = pack(xyz)
    assert packed is not None
    assert packed[1]["step"] == step
    assert unpack(*packed).tobytes() == xyz.tobytes()


@pytest.mark.parametrize(
    "values",
    [
        np.random.default_rng(1).normal(4_630_000, 30, (50, 3)),  # no steps
        np.array([[1.0, 2.0, np.nan]]),
        np.array([[0.0, 0.0, 0.0], [1e9, 0.0, 0.0]]),  # too far apart for 32 bits
        np.empty((0, 3)),
        np.arange(12, dtype=np.float32).reshape(4, 3),
        np.arange(4.0),
    ],
    ids=["no steps", "not a number", "far apart", "empty", "float32", "one axis"],
)
def test_what_are_no_steps_is_not_packed(values: np.ndarray):
    assert pack(values) is None
