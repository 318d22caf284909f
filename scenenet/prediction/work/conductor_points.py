"""The points of a survey that lie on its conductors."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from scenenet.line.records import Conductor
from scenenet.prediction.work.lattice import Lattice, column_of, groups

PIECE_M = 20.0
"""m, pieces of a conductor that are looked up by their bounding boxes."""


def columns_reached(conductor: Conductor, lattice: Lattice) -> set[tuple[int, int]]:
    """(x, y) numbers of the columns of tiles that a conductor reaches into: those that the box
    around a piece of it touches."""
    curve, reach = conductor.catenary, conductor.tube
    steps = np.linspace(0.0, 1.0, 2 + int(curve.length / PIECE_M))
    columns = set()
    for low, high in pairwise(curve.at_shares(steps)[:, :2]):
        (west, south), (east, north) = np.minimum(low, high), np.maximum(low, high)
        columns |= lattice.columns((west - reach, east + reach), (south - reach, north + reach))
    return columns


class ConductorOwners:
    """Says on which conductor a point lies."""

    def __init__(self, conductors: Sequence[Conductor], lattice: Lattice) -> None:
        """Sort the conductors by place."""
        self._lattice = lattice
        self._near: dict[tuple[int, int], list[Conductor]] = {}
        for conductor in conductors:
            for column in columns_reached(conductor, lattice):
                self._near.setdefault(column, []).append(conductor)

    def __call__(self, xyz: np.ndarray, codes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Number of the span (n,) uint32 and of the conductor in it (n,) uint16 of points (n, 3) m
        in the tiles with ``codes`` (n,); 0 for none. Of two conductors it is the nearer one."""
        span, number = np.zeros(len(xyz), np.uint32), np.zeros(len(xyz), np.uint16)
        for code, rows in groups(codes):
            nearest = np.full(len(rows), np.inf)
            for conductor in self._near.get(column_of(code), ()):
                curve = conductor.catenary
                low = min(curve.start[2], curve.end[2]) - conductor.sag - conductor.tube
                high = max(curve.start[2], curve.end[2]) + conductor.tube
                z = xyz[rows, 2]
                near = np.flatnonzero((z >= low) & (z <= high))
                along, beside = curve.along(xyz[rows[near]])
                inside = (along >= 0) & (along <= curve.length)
                near = near[inside & (np.abs(beside) <= conductor.tube)]
                distance = np.hypot(*curve.residuals(xyz[rows[near]]))
                closer = (distance <= conductor.tube) & (distance < nearest[near])
                own = near[closer]
                nearest[own] = distance[closer]
                span[rows[own]], number[rows[own]] = conductor.span_id, conductor.conductor_id
        return span, number
