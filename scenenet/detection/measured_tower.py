"""A tower, measured in points."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scenenet.detection.conductor_rules import POLE_M
from scenenet.detection.conductors import Span
from scenenet.detection.rough import RoughTower
from scenenet.detection.structure import Structure


@dataclass(frozen=True)
class MeasuredTower:
    """A tower, measured in points.

    Attributes:
        x, y: m, centre of its body.
        base: m, elevation of the ground at its axis.
        height: m, from the base to its top.
        width: m, of its body where it stands free.
        free: share of the levels at which its body stands free.
        upright: share of the levels from foot to top with a point of its body.
        spans: directions in which conductors leave, the longest first.
        probability: highest probability of its voxels.
        place, reach: (2,) m, relative to the offset of the detected voxels, and m: within which
            planar radius of which place its detected voxels lie.
        structure: its shape, which says which points are its own.
    """

    x: float
    y: float
    base: float
    height: float
    width: float
    free: float
    upright: float
    spans: tuple[Span, ...]
    probability: float
    place: np.ndarray
    reach: float
    structure: Structure

    @classmethod
    def of(cls, rough: RoughTower, structure: Structure, spans: tuple[Span, ...]) -> MeasuredTower:
        """A tower that was found at a rough one, with the conductors that lead on.

        Their points are no longer needed: a long line has too many to keep those of all towers.
        Where they pass one by one matters beside another pole.
        """
        own = tuple(span.without_places() for span in structure.spans)
        if structure.apart or structure.profile.width > POLE_M:
            own = tuple(span.without_passes() for span in own)
        structure = replace(structure, spans=own)
        return cls(
            x=structure.x,
            y=structure.y,
            base=structure.ground.elevation,
            height=structure.height,
            width=structure.profile.width,
            free=structure.profile.free,
            upright=structure.upright,
            spans=tuple(span.without_places().without_passes() for span in spans),
            probability=rough.probability,
            place=np.array([rough.place_x, rough.place_y]),
            reach=rough.reach,
            structure=structure,
        )

    def moved(self, offset: np.ndarray) -> MeasuredTower:
        """The same tower elsewhere, but for ``place``; ``offset`` is (3,) m."""
        x, y, z = offset.tolist()
        structure = self.structure.moved(x, y, z)
        return replace(self, x=self.x + x, y=self.y + y, base=self.base + z, structure=structure)
