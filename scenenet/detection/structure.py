"""The structure of a tower: which points are its own.

A tower is measured in the points around the axis that the voxels gave. The result is a shape and
not a list of points: a tapered body, crossarms in a plane across the line, and the ground below.
Any point of the survey can be asked whether it lies in the shape.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scenenet.detection.conductor_rules import BESIDE, BESIDE_M, OVER_M, POLE_M, UNDER_TOP
from scenenet.detection.conductors import Span
from scenenet.detection.ground import Ground
from scenenet.detection.head import ARM_M, Head
from scenenet.detection.line_frame import line_frame, rise, sides_of
from scenenet.detection.profile import Profile

MARGIN_M = 0.1
"""m around members: noise of ranging and of the axis."""


@dataclass(frozen=True)
class Structure:
    """The shape of a tower.

    Attributes:
        x, y: m, axis.
        ground: the ground around the axis.
        height: m, from the ground at the axis to the top.
        foot: m above the ground from which points are the tower's own; scrub is below.
        along: (2,) unit vector along the line.
        profile: the body around the axis; its s and t are 0.
        head: the crossarms.
        apart: m, half the distance between the two bodies of a portal, which stand to the left and
            right of the axis; 0 for one body.
        body_top: m, height of the body alone, while its conductors are known. Legs of a window rise
            above it.
        upright: share of the levels of the body that have a point.
        spans: directions in which conductors leave.
        amid: whether it was looked for, and found, amid its conductors.
    """

    x: float
    y: float
    ground: Ground
    height: float
    foot: float
    along: np.ndarray
    profile: Profile
    upright: float
    head: Head
    spans: tuple[Span, ...]
    apart: float = 0.0
    body_top: float = np.inf
    amid: bool = False

    @property
    def reach(self) -> float:
        """m, largest planar distance of a point of the tower from the axis."""
        wide = self.profile.foot + self.apart + MARGIN_M
        return float(np.hypot(max(self.head.reach, wide), wide + ARM_M))

    def moved(self, x: float, y: float, z: float) -> Structure:
        """The same shape elsewhere, m."""
        ground = replace(self.ground, elevation=self.ground.elevation + z)
        return replace(self, x=self.x + x, y=self.y + y, ground=ground)

    def carries(self, length: float) -> bool:
        """Whether it carries conductors of this ``length``, the sum of ``Span.followed``.

        In each direction the lowest is not above its top, and the highest is near that of its body.
        They pass the axis on both sides, or close to it on one.
        """
        if length == 0:
            return True
        top = min(self.height, self.body_top)
        attached = tuple(
            span
            for span in self.spans
            if span.lowest <= self.height + OVER_M and span.highest >= UNDER_TOP * top
        )
        if sum(span.followed for span in attached) < length:
            return False
        sides = sides_of(attached, self.along)
        limit = BESIDE_M if 2 * self.profile.top <= POLE_M else BESIDE * self.height
        return max(min(sides), -max(sides)) <= limit

    def contains(self, xyz: np.ndarray) -> np.ndarray:
        """(N,) bool, which points (N, 3) m are the tower's own."""
        s, t, h = self.frame(xyz)
        return self.in_body(s, t, h) | self.in_arm(s, t, h)

    def frame(self, xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Points (N, 3) m as s along the line, t to its right, h above the ground, (N,) m each."""
        return line_frame(xyz, np.array([self.x, self.y]), self.along, self.ground)

    def in_body(self, s: np.ndarray, t: np.ndarray, h: np.ndarray) -> np.ndarray:
        """(N,) bool, which points in its frame are of the body."""
        half = self.profile.half_width(h) + MARGIN_M
        inside = np.maximum(np.abs(s), np.abs(np.abs(t) - self.apart)) <= half
        return inside & (h >= self.foot) & (self._level(s, t, h) <= self.height + MARGIN_M)

    def in_arm(self, s: np.ndarray, t: np.ndarray, h: np.ndarray) -> np.ndarray:
        """(N,) bool, which points in its frame are of the crossarms."""
        return (np.abs(s) <= self.head.thick) & self.head.covers(t, self._level(s, t, h))

    def _level(self, s: np.ndarray, t: np.ndarray, h: np.ndarray) -> np.ndarray:
        """(N,) m above the ground at the axis: on a slope, a crossarm is level."""
        return h + rise(s, t, self.along, self.ground)


@dataclass(frozen=True)
class BodyTests:
    """What a body has to be to belong to a tower.

    Attributes:
        height: m, smallest height.
        upright: smallest share of the levels with a point.
        free: smallest share of the levels at which it stands free.
    """

    height: float
    upright: float
    free: float

    def passed(self, body: Structure) -> bool:
        return self._stands(body) and body.profile.free >= self.free

    def passed_below_window(self, body: Structure) -> bool:
        """Whether what stands below the window of a tower is its body. In the window is air."""
        return self._stands(body) and body.profile.free_below >= self.free

    def _stands(self, body: Structure) -> bool:
        return body.height >= self.height and body.upright >= self.upright
