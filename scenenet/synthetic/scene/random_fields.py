"""Random fields: noise with a value at every place of the plane, without state.

A corridor is generated stretch by stretch. Both sides of a border must agree on the ground and the
trees, so these are functions of place and seed alone. A line of any length then takes linear time
and bounded memory.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


def hash01(i: np.ndarray, j: np.ndarray, seed: int) -> np.ndarray:
    """A pseudo-random number in [0, 1) for each lattice node (i, j), int64 arrays of one shape."""
    from scenenet.synthetic.scene.hashing import hash_nodes

    numbers = hash_nodes(i.ravel(), j.ravel(), np.uint64(seed & 0xFFFFFFFFFFFFFFFF))
    return numbers.reshape(i.shape)


def value_noise(x: np.ndarray, y: np.ndarray, wavelength: float, seed: int) -> np.ndarray:
    """Smooth noise in [-1, 1]: random values at nodes ``wavelength`` metres apart, interpolated
    between them.

    Args:
        x, y: places, m, both of the same shape.
        wavelength: distance between nodes, m.
        seed: of the field.
    """
    from scenenet.synthetic.scene.hashing import noise_at

    u, v = np.asarray(x, np.float64).ravel(), np.asarray(y, np.float64).ravel()
    values = noise_at(u, v, float(wavelength), np.uint64(seed & 0xFFFFFFFFFFFFFFFF))
    return values.reshape(np.shape(x))


def stream(seed: int, *key: int) -> np.random.Generator:
    """The random generator for ``key`` (purpose, number of the stretch) of a seed."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))


def field_seed(seed: int, name: str) -> int:
    """A 64-bit seed for the noise field called ``name``."""
    key = tuple(name.encode())
    state = np.random.SeedSequence(seed, spawn_key=key).generate_state(1, np.uint64)
    return int(state[0])


@dataclass(frozen=True)
class Raster:
    """Values on a grid whose nodes are at integer multiples of ``step``, so that rasters of
    neighbouring stretches share nodes.

    Attributes:
        i, j: index of the first column (x) and row (y); this node is at (i step, j step).
        step: distance between nodes, m.
        values: (rows along y, columns along x).
    """

    i: int
    j: int
    step: float
    values: np.ndarray

    @classmethod
    def covering(cls, bounds: tuple[float, float, float, float], step: float) -> Raster:
        """Zeros over ``bounds`` (x min, y min, x max, y max; m), with a spare node on each side."""
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
        """Bilinear value (N,) at each place (N,)."""
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
