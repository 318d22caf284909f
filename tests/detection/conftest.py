"""Towers as points: structure, conductors, ground and trees, each with its own code."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from fixtures.scenes import PLACE, conductor_places

from scenenet.synthetic.scene.towers import KINDS, Size, place, sample

TOWER, CONDUCTOR, GROUND, TREE = 15, 16, 2, 5


@dataclass(frozen=True)
class Scene:
    """Points (N, 3) m and their codes (N,); the foot of the tower is at ``foot``."""

    xyz: np.ndarray
    codes: np.ndarray
    foot: np.ndarray

    @property
    def tower(self) -> np.ndarray:
        return self.codes == TOWER

    def keep_every(self, n: int) -> Scene:
        """Every n-th point in random order."""
        rows = np.sort(np.random.default_rng(n).permutation(len(self.xyz))[:: max(n, 1)])
        return Scene(self.xyz[rows], self.codes[rows], self.foot)


def make_tower_scene(
    kind: str = "tubular",
    height: float = 18.0,
    bearing: float = 30.0,
    *,
    density: float = 10.0,
    circuits: int = 1,
    width: float | None = None,
    slope: float = 0.0,
    ground: bool = True,
    bearings: tuple[float, ...] | None = None,
    trees: tuple[tuple[float, float, float], ...] = (),
    foot: tuple[float, float, float] = (1000.3, 2000.7, 50.0),
    seed: int = 0,
) -> Scene:
    """A tower at ``foot`` whose line leads to ``bearing`` degrees and back.

    Args:
        density: points per m2 of surface of its members.
        width: m, of its body, or between the poles of a portal; None for that of its kind.
        slope: rise of the ground per m eastwards.
        bearings: of the conductors; along the line on both sides if None.
        trees: x and y relative to the foot and height of each, m.
    """
    rng = np.random.default_rng(seed)
    structure = KINDS[kind](height, circuits, 0, Size(width))
    azimuth = np.radians(90 - bearing)
    parts = [(place(sample(structure.members, density, rng), 0, 0, 0, azimuth), TOWER)]
    ends = place(structure.attachments, 0, 0, 0, azimuth)
    for direction in bearings if bearings is not None else (bearing, bearing + 180):
        s = np.arange(0.3, 28, 0.25)
        heading = np.array([np.sin(np.radians(direction)), np.cos(np.radians(direction))])
        for end in ends:
            wire = end + np.column_stack([s[:, None] * heading, -0.1 * s + s**2 / 1800])
            parts.append((wire, CONDUCTOR))
    if ground:
        xy = rng.uniform(-28, 28, (50_000, 2))
        xy = xy[np.hypot(*xy.T) <= 28]  # conductors end at the edge of the data
        parts.append((np.column_stack([xy, slope * xy[:, 0]]), GROUND))
    for x, y, top in trees:
        z = rng.uniform(0.2 * top, top, 3000)
        away = 3 * np.sqrt(rng.uniform(0, 1, 3000) * (1 - z / top))
        turn = rng.uniform(0, 2 * np.pi, 3000)
        crown = np.column_stack([x + away * np.cos(turn), y + away * np.sin(turn), z])
        parts.append((crown + np.array([0, 0, slope * x]), TREE))
    xyz = np.concatenate([points for points, _ in parts])
    xyz = xyz + 0.02 * rng.standard_normal(xyz.shape)
    codes = np.concatenate([np.full(len(points), code) for points, code in parts])
    above = (codes != TOWER) | (xyz[:, 2] >= slope * xyz[:, 0]) | (not ground)
    return Scene(xyz[above] + foot, codes[above], np.array(foot))


class Points:
    """Objects as points, placed by hand around ``PLACE``; the ground is at its elevation."""

    place = PLACE

    @staticmethod
    def at(places: np.ndarray) -> np.ndarray:
        """Positions (M, 3) m relative to ``PLACE``, with the noise of a scanner."""
        return (
            places + 0.02 * np.random.default_rng(len(places)).standard_normal(places.shape) + PLACE
        )

    @classmethod
    def ground(cls, radius: float = 30.0, slope: float = 0.0) -> np.ndarray:
        """A disc of ground that rises by ``slope`` m per metre towards the east."""
        x, y = (side.ravel() for side in np.meshgrid(*[np.arange(-radius, radius, 0.5)] * 2))
        places = np.column_stack([x, y, slope * x])
        return cls.at(places[np.hypot(x, y) <= radius])

    @classmethod
    def column(cls, x: float, y: float, low: float, high: float) -> np.ndarray:
        """Points above one another, from ``low`` to ``high`` m, on the axis of a voxel."""
        z = np.arange(low, high, 0.1)
        return cls.at(np.column_stack([np.full(len(z), x + 0.5), np.full(len(z), y + 0.5), z]))

    @classmethod
    def conductors(
        cls,
        bearing: float,
        height: float,
        x: float = 0.0,
        y: float = 0.0,
        end: float = 28.0,
        beside: tuple[float, ...] = (-1.5, 0.0, 1.5),
    ) -> np.ndarray:
        """Conductors from the voxel at (x, y) towards a bearing in degrees, falling by 1 m."""
        return cls.at(conductor_places(bearing, height, x + 0.5, y + 0.5, end, beside))

    @classmethod
    def tree(cls, x: float, y: float, height: float, seed: int = 0) -> np.ndarray:
        """A conifer: a cone of points, widest at a quarter of its height, and its trunk."""
        rng = np.random.default_rng(seed)
        z = rng.uniform(height / 4, height, 1500)
        away = 4 * (1 - z / height) * np.sqrt(rng.uniform(0, 1, 1500))
        turn = rng.uniform(0, 2 * np.pi, 1500)
        crown = np.column_stack([x + away * np.cos(turn), y + away * np.sin(turn), z])
        return cls.together(cls.at(crown), cls.column(x, y, 1, height))

    @classmethod
    def block(cls, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Points that fill the space between the given coordinates."""
        return cls.at(np.column_stack([side.ravel() for side in np.meshgrid(x, y, z)]))

    @staticmethod
    def together(*parts: np.ndarray) -> np.ndarray:
        return np.concatenate(parts)


@pytest.fixture(scope="session")
def points() -> type[Points]:
    return Points


@pytest.fixture(scope="session")
def tower_scene():
    return make_tower_scene
