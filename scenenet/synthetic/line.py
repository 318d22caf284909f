"""Where the towers of a line stand, and the stretches of corridor between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from scenenet.synthetic.noise import stream
from scenenet.synthetic.settings import SHORTEST_SHARE, SyntheticSettings
from scenenet.synthetic.structures import KINDS, Structure, place
from scenenet.synthetic.terrain import Terrain

Numbers = np.ndarray | float

LINE, STRETCH, TOWER = 0, 1, 2
"""First number of the key of a random stream: what it is for."""

CLEARANCE_M = 5.0
"""Wires stay this far above the ground where the places for towers allow it."""


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


@dataclass(frozen=True)
class Strip:
    """The ground of one stretch: |t| <= half_width and low + t k0 <= s <= high + t k1.

    s runs along the span from its first tower, t to its left; borders at bends follow the bisector,
    so that stretches neither overlap nor leave gaps.
    """

    x: float
    y: float
    azimuth: float
    low: float
    high: float
    k0: float
    k1: float
    half_width: float

    def holds(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Which places (N,) on the map lie in the strip."""
        s, t = self.to_strip(x, y)
        between = (s >= self.low + t * self.k0) & (s < self.high + t * self.k1)
        return between & (np.abs(t) <= self.half_width)

    @property
    def area(self) -> float:
        """m^2."""
        return 2 * self.half_width * (self.high - self.low)

    def scatter(self, n: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """x and y of about ``n`` places, uniform over the strip."""
        w = self.half_width
        first, last = self.low - abs(self.k0) * w, self.high + abs(self.k1) * w
        n_box = rng.poisson(n * (last - first) / (self.high - self.low))
        s, t = first + (last - first) * rng.random(n_box), w * (2 * rng.random(n_box) - 1)
        if self.k0 or self.k1:
            keep = (s >= self.low + t * self.k0) & (s < self.high + t * self.k1)
            s, t = s[keep], t[keep]
        return self.to_map(s, t)

    def to_map(self, s: Numbers, t: Numbers) -> tuple[Any, Any]:
        """x and y on the map of places given along and across the line; numbers or arrays."""
        cos, sin = np.cos(self.azimuth), np.sin(self.azimuth)
        return self.x + s * cos - t * sin, self.y + s * sin + t * cos

    def to_strip(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Way along (s) and across (t, to the left) the line of places on the map (N,)."""
        cos, sin = np.cos(self.azimuth), np.sin(self.azimuth)
        dx, dy = x - self.x, y - self.y
        return dx * cos + dy * sin, dy * cos - dx * sin

    def bounds(self, reach: float = 0.0) -> tuple[float, float, float, float]:
        """x min, y min, x max, y max of the strip, ``reach`` metres wider."""
        w = self.half_width
        t = np.array([-w, w, -w, w])
        s = np.array([self.low, self.low, self.high, self.high])
        s = s + t * np.array([self.k0, self.k0, self.k1, self.k1])
        x, y = self.to_map(s, t)
        return x.min() - reach, y.min() - reach, x.max() + reach, y.max() + reach


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
        self._columns = (nodes, bases, heights, kinds, azimuths)

    @property
    def length(self) -> float:
        """Length of the corridor along the line, m."""
        return float(self.spans[1:-1].sum() + sum(self._ends()))

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

    def _ends(self) -> tuple[float, float]:
        margin = self._settings.margin
        return min(margin, 0.9 * self.spans[0]), min(margin, 0.9 * self.spans[-1])

    def strip(self, k: int) -> Strip:
        """Ground of stretch ``k``, between supports k and k + 1."""
        span, last = float(self.spans[k]), self.stretches - 1
        head, tail = self._ends()
        return Strip(
            x=float(self.nodes[k, 0]),
            y=float(self.nodes[k, 1]),
            azimuth=float(self.headings[k]),
            low=span - head if k == 0 else 0.0,
            high=tail if k == last else span,
            # Where the line turns left, the left side of both stretches is the shorter one.
            k0=float(self._half_turns[k]),
            k1=-float(self._half_turns[k + 1]),
            half_width=self._settings.half_width,
        )


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
