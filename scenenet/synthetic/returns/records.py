"""What the compiled loops of the scanner read and write, as records that numba understands."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

LOOP: dict[str, Any] = {"nogil": True, "cache": True, "_nrt": False, "error_model": "numpy"}
"""How the loops over these records are compiled.

``_nrt`` is off because the loops create no arrays: counting references to the arrays of a record
makes them 3 times slower. Divisions by zero do not raise: checking them costs another 30 %."""


class Frame(NamedTuple):
    """Where a strip lies on the map, and its borders; see ``Strip``. Metres."""

    x: float
    y: float
    cos: float
    sin: float
    low: float
    high: float
    k0: float
    k1: float
    half_width: float


class ScanLines(NamedTuple):
    """How scan lines follow each other over a strip; see ``Flight``. Metres.

    Attributes:
        s, t: where the first pulse of the first line comes down, along and across the strip.
    """

    s: float
    t: float
    line_step: float
    pulse_step: float
    skew: float
    sway: float
    offset: float
    height: float


class Grid(NamedTuple):
    """A raster whose first node is column ``i`` and row ``j``; see ``Raster``."""

    values: np.ndarray
    i: int
    j: int
    step: float


class CoverGrids(NamedTuple):
    """The four rasters of ``Cover``, which share their nodes."""

    grass: np.ndarray
    tallness: np.ndarray
    rise: np.ndarray
    water: np.ndarray
    i: int
    j: int
    step: float


class Scene(NamedTuple):
    """Everything that a pulse can meet, and how it returns.

    Attributes:
        ground: elevation of the ground, m; the step is 1 m.
        crowns: (rows, columns, 4): elevation of the top and bottom of the canopy and of a roof, m,
            -inf where there is none, and the density of the foliage over its mean.
        ceiling: greatest height of anything above the ground near each cell, m.
        cover: what the ground is covered with.
        foliage: (z, y, x) bool, where a crown has leaves; the block repeats.
        hit: probability that a step through foliage gives a return.
        depths: stray returns deep in the crowns, over their mean.
        noise: standard deviation of a position, m.
        lower_ground: share of the returns from bare ground with the class of its lower returns.
        key_points: share of the returns that may be key points.
    """

    ground: Grid
    crowns: Grid
    ceiling: Grid
    cover: CoverGrids
    foliage: np.ndarray
    hit: float
    depths: float
    noise: float
    lower_ground: float
    key_points: float


class Returns(NamedTuple):
    """Where the returns are written.

    Attributes:
        xyz: (N, 3) float64, m.
        code: (N,) uint8 class codes.
        marked: (3, rows, columns) bool: cells of the ground that already have their key point of
            ground, grass and scrub.
    """

    xyz: np.ndarray
    code: np.ndarray
    marked: np.ndarray


class Pulse(NamedTuple):
    """One pulse.

    Attributes:
        s, t: where it meets the ground, along and across the strip, m.
        x, y, z: the same on the map, m.
        lean: metres it moves across for each metre of height.
        up: height above the ground from which it can meet anything, m.
    """

    s: float
    t: float
    x: float
    y: float
    z: float
    lean: float
    up: float


class Crossing(NamedTuple):
    """The part of a pulse's way that lies over one cell of the canopy.

    Attributes:
        t: where it is across the strip, m, in the middle of this part.
        x, y: the same on the map, m.
        start, end: heights above the foot of the pulse between which it can return, m.
        solid: a roof or wall is hit at ``start``.
        inside: returns from here belong to the strip.
        leaf: probability that a step through foliage gives a return.
    """

    t: float
    x: float
    y: float
    start: float
    end: float
    solid: bool
    inside: bool
    leaf: float
