"""Seeded noise that has a value at every place of the plane, without any state.

A corridor is made stretch by stretch. What both sides of a border must agree on (the ground, where
a tree stands) is a function of the place and the seed alone, so that a line of any length costs
linear time and bounded memory.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

_X = np.uint64(0x9E3779B97F4A7C15)
_Y = np.uint64(0xC2B2AE3D27D4EB4F)
_MIX = np.uint64(0xBF58476D1CE4E5B9)
_MIX2 = np.uint64(0x94D049BB133111EB)


def hash01(i: np.ndarray, j: np.ndarray, seed: int) -> np.ndarray:
    """A pseudo-random number in [0, 1) for each lattice node (i, j), int64 arrays of one shape."""
    numbers = _hash01(i.ravel(), j.ravel(), np.uint64(seed & 0xFFFFFFFFFFFFFFFF))
    return numbers.reshape(i.shape)


_STEP = np.uint64(0x9E3779B97F4A7C15)


@numba.njit(nogil=True, cache=True, inline="always")
def next_state(state):  # type: ignore[no-untyped-def]
    """The state (uint64) after ``state`` of a random sequence."""
    return state + _STEP


@numba.njit(nogil=True, cache=True, inline="always")
def uniform(state):  # type: ignore[no-untyped-def]
    """The number in [0, 1) that belongs to ``state`` (uint64); splitmix64."""
    value = state
    value ^= value >> np.uint64(30)
    value *= _MIX
    value ^= value >> np.uint64(27)
    value *= _MIX2
    value ^= value >> np.uint64(31)
    return (value >> np.uint64(11)) * 2.0**-53


@numba.njit(nogil=True, cache=True, inline="always")
def _node(i, j, seed):  # type: ignore[no-untyped-def]
    """Number of the node (i, j), int64; neighbouring nodes come out unrelated."""
    return uniform((np.uint64(i) * _X + np.uint64(j) * _Y) ^ seed)


@numba.njit(nogil=True, cache=True)
def _hash01(i, j, seed):  # type: ignore[no-untyped-def]
    out = np.empty(len(i))
    for k in range(len(i)):
        out[k] = _node(i[k], j[k], seed)
    return out


def value_noise(x: np.ndarray, y: np.ndarray, wavelength: float, seed: int) -> np.ndarray:
    """Smooth noise in [-1, 1]: random values at nodes ``wavelength`` metres apart, faded between.

    Args:
        x, y: places, m, both of the same shape.
        wavelength: distance of the nodes, m.
        seed: chooses the field.
    """
    u, v = np.asarray(x, np.float64).ravel(), np.asarray(y, np.float64).ravel()
    values = _value_noise(u, v, float(wavelength), np.uint64(seed & 0xFFFFFFFFFFFFFFFF))
    return values.reshape(np.shape(x))


@numba.njit(nogil=True, cache=True)
def _value_noise(x, y, wavelength, seed):  # type: ignore[no-untyped-def]
    out = np.empty(len(x))
    i, j = np.int64(0), np.int64(0)
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    known = False
    for k in range(len(x)):
        u, v = x[k] / wavelength, y[k] / wavelength
        column, row = np.int64(np.floor(u)), np.int64(np.floor(v))
        # Places come in rows: mostly the nodes around one are those of the one before.
        if not known or column != i or row != j:
            i, j, known = column, row, True
            a, b = _node(i, j, seed), _node(i + 1, j, seed)
            c, d = _node(i, j + 1, seed), _node(i + 1, j + 1, seed)
        u, v = u - i, v - j
        # Quintic steps with vanishing first and second derivative at both ends: no creases.
        u = u * u * u * (u * (u * 6.0 - 15.0) + 10.0)
        v = v * v * v * (v * (v * 6.0 - 15.0) + 10.0)
        low, high = a + (b - a) * u, c + (d - c) * u
        out[k] = 2.0 * (low + (high - low) * v) - 1.0
    return out


def stream(seed: int, *key: int) -> np.random.Generator:
    """The random generator that belongs to ``key`` (which part, which stretch) of a seed."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))


def field_seed(seed: int, name: str) -> int:
    """A 64-bit seed for the noise field called ``name``."""
    key = tuple(name.encode())
    state = np.random.SeedSequence(seed, spawn_key=key).generate_state(1, np.uint64)
    return int(state[0])


@dataclass(frozen=True)
class Raster:
    """Values on a grid whose nodes lie at whole multiples of ``step``, so that rasters of
    neighbouring stretches share their nodes.

    Attributes:
        i, j: index of the first column (x) and row (y); the node lies at (i step, j step).
        step: distance of nodes, m.
        values: (rows along y, columns along x).
    """

    i: int
    j: int
    step: float
    values: np.ndarray

    @classmethod
    def covering(cls, bounds: tuple[float, float, float, float], step: float) -> Raster:
        """Zeros over ``bounds`` (x min, y min, x max, y max; m), one node to spare on each side."""
        i, j = int(np.floor(bounds[0] / step)) - 1, int(np.floor(bounds[1] / step)) - 1
        columns = int(np.ceil(bounds[2] / step)) + 2 - i
        rows = int(np.ceil(bounds[3] / step)) + 2 - j
        return cls(i, j, step, np.zeros((rows, columns)))

    def nodes(self) -> tuple[np.ndarray, np.ndarray]:
        """x and y of the nodes, m, both of the shape of ``values``."""
        rows, columns = self.values.shape
        x = (self.i + np.arange(columns)) * self.step
        y = (self.j + np.arange(rows)) * self.step
        return np.broadcast_to(x, (rows, columns)), np.broadcast_to(y[:, None], (rows, columns))

    def nearest(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Flat index (into ``values.ravel()``) of the node nearest to each place (N,)."""
        rows, columns = self.values.shape
        column = np.floor(x * (1.0 / self.step) + 0.5).astype(np.int64) - self.i
        row = np.floor(y * (1.0 / self.step) + 0.5).astype(np.int64) - self.j
        return row.clip(0, rows - 1) * columns + column.clip(0, columns - 1)

    def bilinear(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Value between the nodes at each place (N,)."""
        u, v = x / self.step, y / self.step
        column, row = np.floor(u), np.floor(v)
        u -= column
        v -= row
        width = self.values.shape[1]
        at = (row.astype(np.int64) - self.j) * width + (column.astype(np.int64) - self.i)
        flat = self.values.ravel()
        return blend(flat[at], flat[at + 1], flat[at + width], flat[at + width + 1], u, v)


def blend(
    v00: np.ndarray, v10: np.ndarray, v01: np.ndarray, v11: np.ndarray, u: np.ndarray, v: np.ndarray
) -> np.ndarray:
    """Bilinear blend of four node values; u along x, v along y, both in [0, 1]."""
    low = v00 + (v10 - v00) * u
    high = v01 + (v11 - v01) * u
    return low + (high - low) * v
