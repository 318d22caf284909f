"""Where the towers of a line stand, and the stretches of corridor between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenenet.synthetic.scene.random_fields import stream
from scenenet.synthetic.scene.strip import Strip
from scenenet.synthetic.scene.terrain import Terrain
from scenenet.synthetic.scene.towers import KINDS, Structure, place
from scenenet.synthetic.settings import SHORTEST_SHARE, SyntheticSettings

LINE, STRETCH, TOWER, FLIGHT, FOOT = 0, 1, 2, 3, 4
"""First number of the key of a random stream: what it is for."""

CLEARANCE_M = 5.0
"""Wires stay this far above the ground where the places for towers allow it."""

FLIGHT_TOWERS = 6
"""A helicopter keeps its height and speed over so many towers, where the survey has no gaps."""


@dataclass(frozen=True)
class Support:
    """A tower as it stands, in metres from the start of the line.

    Attributes:
        x, y: centre of its foot.
        base: elevation of the ground there.
        height: from the foot to the top.
        kind: see ``structures.KINDS``.
        azimuth: direction of the line at the tower (bisector at a bend), radians from east.
        structure: its members, in the tower's own frame.
        attachments: (W, 3) where its wires hold on.
    """

    x: float
    y: float
    base: float
    height: float
    kind: str
    azimuth: float
    structure: Structure
    attachments: np.ndarray


class Line:
    """The towers of a line and, around them, its stretches.

    ``supports`` has one more at either end than there are towers: those two stand outside the
    corridor and only hold the wires that leave it.
    """

    def __init__(self, settings: SyntheticSettings, terrain: Terrain) -> None:
        self._settings = settings
        rng = stream(settings.seed, LINE)
        n = settings.towers + 2
        heights = rng.uniform(*settings.height, size=n)
        # Sorted: the order in which a file lists the kinds must not change the line.
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
        """Number of stretches: one before the first tower, between two towers, after the last."""
        return len(self.spans)

    def support(self, k: int) -> Support:
        """Support ``k``; 1 .. ``towers`` are the towers of the survey."""
        nodes, bases, heights, kinds, azimuths = self._columns
        settings = self._settings
        height, base, azimuth = float(heights[k]), float(bases[k]), float(azimuths[k])
        x, y = map(float, nodes[k])
        structure = KINDS[kinds[k]](height, settings.circuits, settings.earth_wires)
        held = place(structure.attachments, x, y, base, azimuth)
        return Support(x, y, base, height, str(kinds[k]), azimuth, structure, held)

    def _beyond(self) -> float:
        """Of the ends of gaps, what belongs to the supports outside the corridor, m."""
        margin = self._settings.margin
        return float(sum(min(margin, 0.45 * self.spans[k]) for k in (0, -1)))

    def strips(self, k: int) -> list[Strip]:
        """Ground of stretch ``k``, between supports k and k + 1: all of it, or at a gap of the
        survey what lies near its towers."""
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
            # Where the line turns left, the left side of both stretches is the shorter one. Gaps
            # are cut straight.
            k0=float(self._half_turns[k]) if low == 0.0 else 0.0,
            k1=-float(self._half_turns[k + 1]) if high == self.spans[k] else 0.0,
            half_width=self._settings.half_width,
        )


def _sections(
    n: int, settings: SyntheticSettings, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Number of the flight (n,) that scanned each stretch, and whether (n,) it is a gap.

    The stretches before the first and behind the last tower are gaps: the survey ends there.
    """
    flight, gap = np.zeros(n, int), np.zeros(n, bool)
    gap[[0, -1]] = True
    mean = settings.section or FLIGHT_TOWERS
    left, number = 0, -1
    for k in range(n):
        if left == 0:
            # A section has two towers or more: they stand at its ends.
            left = int(rng.integers(max(2, mean // 2), max(3, mean + mean // 2 + 1)))
            number += 1
            gap[k] |= settings.section > 0
        flight[k] = number
        left -= 1
    return flight, gap


def _headings(n: int, settings: SyntheticSettings, rng: np.random.Generator) -> np.ndarray:
    """Direction (n,) of each span, radians: straight runs around one main direction, so that a
    line never meets itself."""
    most = np.radians(settings.bend) / 2
    deviation = np.empty(n)
    current = 0.0
    for k in range(n):
        if rng.random() < settings.bend_share:
            current = rng.uniform(-most, most)
        deviation[k] = current
    return rng.uniform(0, 2 * np.pi) + deviation


def _walk(
    headings: np.ndarray,
    heights: np.ndarray,
    settings: SyntheticSettings,
    terrain: Terrain,
    rng: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray]:
    """Places (n, 2) of the supports, m, and the elevation of their feet (n,).

    Of some distances around the mean span the first is taken at which the wires stay clear of the
    ground, as a surveyor would; else the best.
    """
    nodes, bases = np.zeros((len(heights), 2)), np.empty(len(heights))
    bases[0] = terrain.height(np.zeros(1), np.zeros(1))[0]
    u = np.linspace(0.05, 1.0, 20)
    for k, heading in enumerate(headings):
        drawn = settings.span + settings.span_spread * np.clip(rng.standard_normal(3), -2, 2)
        lengths = np.r_[drawn, drawn[0] * np.array([0.85, 0.7, SHORTEST_SHARE])]
        s = lengths[:, None] * u
        x = nodes[k, 0] + s * np.cos(heading)
        y = nodes[k, 1] + s * np.sin(heading)
        ground = terrain.height(x, y)
        # The lowest conductor holds on at about 0.7 of the height of a pylon and higher on a pole.
        first, last = bases[k] + 0.7 * heights[k], ground[:, -1:] + 0.7 * heights[k + 1]
        sag = s * (lengths[:, None] - s) / (2 * settings.catenary)
        clearance = (first + (last - first) * u - sag - ground).min(axis=1)
        clear = clearance >= min(CLEARANCE_M, 0.3 * settings.height[0])
        best = int(np.argmax(clear)) if clear.any() else int(np.argmax(clearance))
        nodes[k + 1] = x[best, -1], y[best, -1]
        bases[k + 1] = ground[best, -1]
    return nodes, bases
