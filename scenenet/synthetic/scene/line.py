"""The towers of a line, and the stretches of corridor between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenenet.synthetic.scene.random_fields import stream
from scenenet.synthetic.scene.strip import Strip
from scenenet.synthetic.scene.tension import strung
from scenenet.synthetic.scene.terrain import Terrain
from scenenet.synthetic.scene.towers import KINDS, Size, Structure, place
from scenenet.synthetic.settings import SHORTEST_SHARE, SyntheticSettings

LINE, STRETCH, TOWER, FLIGHT, FOOT, TENSION = 0, 1, 2, 3, 4, 5
"""First number of the key of a random stream: its purpose."""

CLEARANCE_M = 5.0
"""Least height of conductors above the ground, if a place for the next tower allows it, m."""

FLIGHT_TOWERS = 6
"""Towers over which a flight keeps its height and speed, in a survey without gaps."""


@dataclass(frozen=True)
class Support:
    """A tower in place, in metres from the start of the line.

    Attributes:
        x, y: centre of its foot.
        base: elevation of the ground there.
        height: from the foot to the top.
        kind: see ``towers.KINDS``.
        azimuth: direction of the line at the tower (bisector at a bend), radians from east.
        structure: its members, in the frame of the tower.
        behind, ahead: (W, 3) where the conductors and earth wires of the span behind and of the
            span ahead are attached; the same places where it only carries them.
        tension: whether it ends its conductors (``tension``).
    """

    x: float
    y: float
    base: float
    height: float
    kind: str
    azimuth: float
    structure: Structure
    behind: np.ndarray
    ahead: np.ndarray
    tension: bool


class Line:
    """The towers of a line and, around them, its stretches.

    There is one support more at each end than there are towers: those two are outside the
    corridor and only hold the conductors that leave it.
    """

    def __init__(self, settings: SyntheticSettings, terrain: Terrain) -> None:
        self._settings = settings
        rng = stream(settings.seed, LINE)
        n = settings.towers + 2
        heights = (
            rng.uniform(*settings.height, size=n)
            if settings.height_mean is None
            else skewed(settings.height, settings.height_mean, rng.random(n))
        )
        # Sorted, so that the order of the kinds in a file does not change the line.
        names = sorted(settings.kinds)
        weights = np.array([settings.kinds[name] for name in names])
        kinds = rng.choice(names, size=n, p=weights / weights.sum())
        headings = _headings(n - 1, settings, rng)
        nodes, bases = _walk(headings, heights, settings, terrain, rng)
        self.headings = headings
        self.nodes = nodes
        self.spans = np.hypot(*np.diff(nodes, axis=0).T)
        turns = np.diff(headings)
        azimuths = np.r_[headings[0], headings[:-1] + turns / 2, headings[-1]]
        self._half_turns = np.r_[0.0, np.tan(turns / 2), 0.0]
        self.flight, self._gap = _sections(n - 1, settings, rng)
        self._columns = (nodes, bases, heights, kinds, azimuths)

    @property
    def length(self) -> float:
        """Length of the corridor along the line, m; gaps are not counted."""
        ends = 2 * np.minimum(self._settings.margin, 0.45 * self.spans[self._gap])
        return float(self.spans[~self._gap].sum() + ends.sum() - self._beyond())

    @property
    def stretches(self) -> int:
        """Number of stretches: before the first tower, between towers, after the last."""
        return len(self.spans)

    def support(self, k: int) -> Support:
        """Support ``k``; 1 .. ``towers`` are the towers of the survey."""
        nodes, bases, heights, kinds, azimuths = self._columns
        settings = self._settings
        height, base, azimuth = float(heights[k]), float(bases[k]), float(azimuths[k])
        x, y = map(float, nodes[k])
        size = Size(settings.body_width, settings.arm_reach)
        structure = KINDS[kinds[k]](height, settings.circuits, settings.earth_wires, size)
        behind = ahead = structure.attachments
        tension = self._is_tension(k)
        if tension:
            made = strung(structure, float(np.arctan(self._half_turns[k])))
            structure, behind, ahead = made.structure, made.behind, made.ahead
        behind, ahead = (place(ends, x, y, base, azimuth) for ends in (behind, ahead))
        return Support(
            x, y, base, height, str(kinds[k]), azimuth, structure, behind, ahead, tension
        )

    def _is_tension(self, k: int) -> bool:
        """Whether support ``k`` ends its conductors: at every bend, and at some other towers."""
        settings = self._settings
        if settings.tension == 0:
            return False
        drawn = stream(settings.seed, TENSION, k).random() < settings.tension
        return bool(drawn or self._half_turns[k] != 0)

    def _beyond(self) -> float:
        """Length of the ends of gaps that belong to the supports outside the corridor, m."""
        margin = self._settings.margin
        return float(sum(min(margin, 0.45 * self.spans[k]) for k in (0, -1)))

    def strips(self, k: int) -> list[Strip]:
        """Ground of stretch ``k``, between supports k and k + 1: all of it, or at a gap of the
        survey the parts near its towers."""
        span, last = float(self.spans[k]), self.stretches - 1
        if not self._gap[k]:
            return [self._strip(k, 0.0, span)]
        end = min(self._settings.margin, 0.45 * span)
        strips = []
        if k > 0:
            strips.append(self._strip(k, 0.0, end))
        if k < last:
            strips.append(self._strip(k, span - end, span))
        return strips

    def _strip(self, k: int, low: float, high: float) -> Strip:
        return Strip(
            x=float(self.nodes[k, 0]),
            y=float(self.nodes[k, 1]),
            azimuth=float(self.headings[k]),
            low=low,
            high=high,
            # Where the line turns left, the left side of both stretches is shorter. Gaps have
            # straight ends.
            k0=float(self._half_turns[k]) if low == 0.0 else 0.0,
            k1=-float(self._half_turns[k + 1]) if high == self.spans[k] else 0.0,
            half_width=self._settings.half_width,
        )


def _sections(
    n: int, settings: SyntheticSettings, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Number (n,) of the flight that scanned each stretch, and whether (n,) it is a gap. All are
    where every tower is alone.

    The stretches before the first and after the last tower are gaps: the survey ends there.
    """
    flight, gap = np.zeros(n, int), np.zeros(n, bool)
    gap[[0, -1]] = True
    mean = settings.section or FLIGHT_TOWERS
    if settings.section == 1:
        return np.arange(n) // FLIGHT_TOWERS, np.ones(n, bool)
    left, number = 0, -1
    for k in range(n):
        if left == 0:
            # A section has two towers or more, with one at each end.
            left = int(rng.integers(max(2, mean // 2), max(3, mean + mean // 2 + 1)))
            number += 1
            gap[k] |= settings.section > 0
        flight[k] = number
        left -= 1
    return flight, gap


def _headings(n: int, settings: SyntheticSettings, rng: np.random.Generator) -> np.ndarray:
    """Direction (n,) of each span, radians: straight runs around one main direction, so that a
    line never crosses itself."""
    most = np.radians(settings.bend) / 2
    deviation = np.empty(n)
    current = 0.0
    for k in range(n):
        if rng.random() < settings.bend_share:
            current = rng.uniform(-most, most)
        deviation[k] = current
    return rng.uniform(0, 2 * np.pi) + deviation


def skewed(limits: tuple[float, float], mean: float, draw: np.ndarray) -> np.ndarray:
    """Numbers between two limits, with their mean there, from uniform ``draw`` in [0, 1).

    It is the distribution of a power of a uniform number, seen from the limit that the mean is
    nearer to, and uniform if the mean is in the middle.
    """
    low, high = limits
    near, far = (low, high) if mean - low < high - mean else (high, low)
    return near + (far - near) * draw ** ((far - near) / (mean - near) - 1)


def _walk(
    headings: np.ndarray,
    heights: np.ndarray,
    settings: SyntheticSettings,
    terrain: Terrain,
    rng: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray]:
    """Places (n, 2) of the supports, m, and the elevation of their feet (n,).

    Of several random spans it takes the first at which the conductors stay clear of the ground, as
    a surveyor would, or else the one with the most clearance.
    """
    nodes, bases = np.zeros((len(heights), 2)), np.empty(len(heights))
    bases[0] = terrain.height(np.zeros(1), np.zeros(1))[0]
    u = np.linspace(0.05, 1.0, 20)
    for k, heading in enumerate(headings):
        if settings.span_limits is None:
            drawn = settings.span + settings.span_spread * np.clip(rng.standard_normal(3), -2, 2)
            shorter = drawn[0] * np.array([0.85, 0.7, SHORTEST_SHARE])
        else:
            drawn = skewed(settings.span_limits, settings.span, rng.random(3))
            shorter = np.maximum(drawn[0] * np.array([0.85, 0.7, 0]), settings.span_limits[0])
        lengths = np.r_[drawn, shorter]
        s = lengths[:, None] * u
        x = nodes[k, 0] + s * np.cos(heading)
        y = nodes[k, 1] + s * np.sin(heading)
        ground = terrain.height(x, y)
        # The lowest conductor is attached at about 0.7 of the height of a pylon, higher on a pole.
        first, last = bases[k] + 0.7 * heights[k], ground[:, -1:] + 0.7 * heights[k + 1]
        sag = s * (lengths[:, None] - s) / (2 * settings.catenary)
        clearance = (first + (last - first) * u - sag - ground).min(axis=1)
        clear = clearance >= min(CLEARANCE_M, 0.3 * settings.height[0])
        best = int(np.argmax(clear)) if clear.any() else int(np.argmax(clearance))
        nodes[k + 1] = x[best, -1], y[best, -1]
        bases[k + 1] = ground[best, -1]
    return nodes, bases
