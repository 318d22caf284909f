"""Clutter: objects that resemble a tower, houses and fences.

They have no class of their own: as in the public TS40K crops they are low or tall, like vegetation.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from scenenet.synthetic.codes import LOW, TALL, TALL_M
from scenenet.synthetic.returns.flight import Flight
from scenenet.synthetic.scene.random_fields import Raster
from scenenet.synthetic.scene.strip import Strip
from scenenet.synthetic.scene.towers import place, sample
from scenenet.synthetic.settings import SyntheticSettings

CLEAR_M = 6.0
"""Distance from the towers at the ends of a strip, m."""

Members = np.ndarray


def mast(rng: np.random.Generator) -> Members:
    """A single pole without conductors."""
    height = rng.uniform(6.0, 14.0)
    return np.array([[0, 0, 0, 0, 0, height, 0.11, 0.06]])


def street_light(rng: np.random.Generator) -> Members:
    """A pole with a lamp on an arm."""
    height = rng.uniform(5.0, 8.0)
    return np.array(
        [[0, 0, 0, 0, 0, height, 0.09, 0.06], [0, 0, height, 1.6, 0, height + 0.2, 0.06, 0.1]]
    )


def dead_tree(rng: np.random.Generator) -> Members:
    """A bare trunk with rising branches."""
    height = rng.uniform(6.0, 15.0)
    lean = rng.uniform(-0.08, 0.08, 2) * height
    rows = [[0, 0, 0, lean[0], lean[1], height, 0.02 * height, 0.04]]
    for _ in range(rng.integers(6, 14)):
        share = rng.uniform(0.3, 0.95)
        azimuth, length = rng.uniform(0, 2 * np.pi), height * 0.3 * (1.15 - share)
        x, y, z = lean[0] * share, lean[1] * share, height * share
        dx, dy = length * np.cos(azimuth), length * np.sin(azimuth)
        rows.append([x, y, z, x + dx, y + dy, z + rng.uniform(0.2, 0.9) * length, 0.06, 0.02])
    return np.array(rows)


def crane(rng: np.random.Generator) -> Members:
    """A tower crane: lattice mast, jib and counter-jib."""
    height, half = rng.uniform(22.0, 38.0), 0.7
    rows = []
    levels = np.linspace(0, height, round(height / 1.6) + 1)
    corners = ((-half, -half), (half, -half), (half, half), (-half, half))
    for (ax, ay), (bx, by) in zip(corners, (*corners[1:], corners[0]), strict=True):
        rows.append([ax, ay, 0, ax, ay, height, 0.07, 0.07])
        for k, (z0, z1) in enumerate(itertools.pairwise(levels)):
            a, b = ((ax, ay), (bx, by)) if k % 2 else ((bx, by), (ax, ay))
            rows.append([*a, z0, *b, z1, 0.04, 0.04])
    jib, counter = 0.9 * height, 0.3 * height
    for y, z in ((-half, height), (half, height), (0, height + 1.2)):
        rows.append([-counter, y, z, jib, y, z, 0.06, 0.06])
    rows.append([0, 0, height, 0, 0, height + 5.0, 0.12, 0.08])
    rows.append([0, 0, height + 5.0, 0.8 * jib, 0, height + 1.2, 0.03, 0.03])
    rows.append([0, 0, height + 5.0, -counter, 0, height + 1.2, 0.03, 0.03])
    return np.array(rows, float)


def fence(rng: np.random.Generator) -> Members:
    """Posts and four wires, along x."""
    length, height = rng.uniform(12.0, 30.0), rng.uniform(1.1, 1.6)
    posts = np.arange(-length / 2, length / 2, 2.5)
    rows = [[x, 0, 0, x, 0, height, 0.06, 0.06] for x in posts]
    rows += [
        [-length / 2, 0, z, length / 2, 0, z, 0.012, 0.012] for z in np.linspace(0.3, height, 4)
    ]
    return np.array(rows)


MAKERS: Mapping[str, Callable[[np.random.Generator], Members]] = MappingProxyType(
    {
        "mast": mast,
        "street_light": street_light,
        "dead_tree": dead_tree,
        "crane": crane,
        "fence": fence,
    }
)
"""Kinds that are made of members (M, 8), as towers are; houses are surfaces."""


def clutter_points(
    strip: Strip,
    terrain: Raster,
    solid: Raster,
    flight: Flight,
    settings: SyntheticSettings,
    rng: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) and class codes (N,) of clutter made of members; houses are added to ``solid``.

    Clutter is next to the line and keeps away from the ends of the strip.

    Args:
        solid: height of roofs above the ground, m; changed in place.
    """
    room = strip.high - strip.low - 2 * CLEAR_M
    names = sorted(settings.clutter_kinds)
    weights = np.array([settings.clutter_kinds[name] for name in names])  # type: ignore[index]
    parts, codes = [np.empty((0, 3))], [np.empty(0, np.uint8)]
    for _ in range(rng.poisson(settings.clutter * max(room, 0.0) / 1000.0)):
        kind = str(rng.choice(names, p=weights / weights.sum()))
        s = strip.low + CLEAR_M + room * rng.random()
        t = rng.choice((-1, 1)) * strip.half_width * rng.uniform(0.3, 1.05)
        x, y = (float(v) for v in strip.to_map(s, t))
        if kind == "house":
            _house(solid, x, y, rng.uniform(0, 2 * np.pi), rng)
            continue
        members = MAKERS[kind](rng)
        points = sample(members, settings.tower_density * flight.solids, rng)
        # Fences follow the ground below each point.
        foot = terrain.bilinear(np.array([x]), np.array([y]))[0]
        points = place(points, x, y, foot, rng.uniform(0, 2 * np.pi))
        points = points[strip.holds(points[:, 0], points[:, 1])]
        ground = terrain.bilinear(points[:, 0], points[:, 1])
        if kind == "fence":
            points[:, 2] += ground - foot
        points += settings.ranging_noise * rng.standard_normal(points.shape)
        points, ground = points[points[:, 2] >= ground], ground[points[:, 2] >= ground]
        parts.append(points)
        tall = points[:, 2] - ground >= TALL_M
        codes.append(np.where(tall, np.uint8(TALL), np.uint8(LOW)))
    return np.concatenate(parts), np.concatenate(codes)


def _house(solid: Raster, x: float, y: float, azimuth: float, rng: np.random.Generator) -> None:
    """Add a gabled roof at (x, y) to ``solid``."""
    half_length, half_width = rng.uniform(2.5, 6.0), rng.uniform(1.5, 4.0)
    eaves, ridge = rng.uniform(2.3, 4.0), rng.uniform(0.3, 2.0)
    node_x, node_y = solid.nodes()
    dx, dy = node_x - x, node_y - y
    along = dx * np.cos(azimuth) + dy * np.sin(azimuth)
    across = np.abs(dy * np.cos(azimuth) - dx * np.sin(azimuth))
    inside = (np.abs(along) <= half_length) & (across <= half_width)
    solid.values[inside] = (eaves + ridge * (1 - across / half_width))[inside]
