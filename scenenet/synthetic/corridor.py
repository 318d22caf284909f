"""A whole synthetic corridor, made stretch by stretch."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from copy import deepcopy
from dataclasses import dataclass

import numpy as np
import pyproj
import pyproj.exceptions

from scenenet.core.errors import InputError
from scenenet.line.catenary import Catenary
from scenenet.pointcloud.class_schemes import EDP
from scenenet.pointcloud.cloud import PointCloud
from scenenet.synthetic.annotation_noise import annotate
from scenenet.synthetic.codes import TOWER
from scenenet.synthetic.returns.clutter import clutter_points
from scenenet.synthetic.returns.conductors import (
    conductor_points,
    jumper_points,
    middles,
    other_cables,
)
from scenenet.synthetic.returns.flight import Flight, flight_of
from scenenet.synthetic.returns.scan import Scanner
from scenenet.synthetic.returns.stray_returns import stray_points
from scenenet.synthetic.scene.ground_cover import GroundCover
from scenenet.synthetic.scene.line import FOOT, STRETCH, Line, Support
from scenenet.synthetic.scene.random_fields import Raster, stream
from scenenet.synthetic.scene.strip import Strip
from scenenet.synthetic.scene.terrain import Terrain
from scenenet.synthetic.scene.towers import place, sample
from scenenet.synthetic.scene.vegetation import WIDEST_CROWN_M, Plants, Vegetation, keep_clear
from scenenet.synthetic.settings import SyntheticSettings
from scenenet.synthetic.truth import TrueConductor, TrueTower, TrueTree

Coded = tuple[np.ndarray, np.ndarray]
"""Points (N, 3) and their codes (N,)."""


@dataclass(frozen=True)
class Stretch:
    """The points of one stretch of the corridor.

    Attributes:
        index: 0, 1, ... along the line.
        xyz: (N, 3) float64, m, in the survey's CRS.
        labels: (N,) uint8 ``edp`` codes as an annotator assigns them.
        truth: (N,) uint8 ``edp`` codes without annotation noise.
    """

    index: int
    xyz: np.ndarray
    labels: np.ndarray
    truth: np.ndarray


class Corridor:
    """A corridor that is generated while it is iterated over; memory is that of one stretch.

    Attributes:
        settings: of the survey.
        crs: CRS of all coordinates.
        length: length along the line, m.
    """

    def __init__(self, settings: SyntheticSettings) -> None:
        self.settings = settings
        self.crs = _crs(settings.epsg)
        self.terrain = Terrain(settings)
        self.line = Line(settings, self.terrain)
        self.length = self.line.length
        self._vegetation = Vegetation(settings)
        self._cover = GroundCover(settings)
        self._scanner = Scanner(settings)
        self._origin = np.array([settings.easting, settings.northing, 0.0])

    def __len__(self) -> int:
        """Number of stretches."""
        return self.line.stretches

    @property
    def towers(self) -> list[TrueTower]:
        """The true towers, along the line."""
        found = []
        for number in range(1, self.settings.towers + 1):
            support = self.line.support(number)
            x, y = support.x + self._origin[0], support.y + self._origin[1]
            found.append(TrueTower(number, x, y, support.base, support.height, type=support.kind))
        return found

    @property
    def conductors(self) -> list[TrueConductor]:
        """The true conductors and earth wires, span by span along the line.

        Those before the first and after the last tower leave the survey.
        """
        settings, found = self.settings, []
        n_conductors = 3 * settings.circuits
        for number in range(len(self)):
            before, after = self.line.support(number), self.line.support(number + 1)
            ends = (
                middles(held, tower.azimuth, settings.bundle, n_conductors) + self._origin
                for tower, held in ((before, before.ahead), (after, after.behind))
            )
            for number_at, (start, end) in enumerate(zip(*ends, strict=True)):
                is_earth = number_at >= n_conductors
                found.append(
                    TrueConductor(
                        from_tower=number,
                        to_tower=number + 1 if number < settings.towers else 0,
                        place=number_at,
                        is_earth_wire=is_earth,
                        subconductors=1 if is_earth else settings.bundle,
                        catenary=Catenary.of(start, end, settings.catenary),
                    )
                )
        return found

    @property
    def trees(self) -> list[TrueTree]:
        """The true trees, stretch by stretch; without bushes, hedges and dead trees."""
        found = []
        for strip in (strip for number in range(len(self)) for strip in self.line.strips(number)):
            trees = self._trees(strip, strip.bounds())
            inside = strip.holds(trees.x, trees.y)
            base = self.terrain.height(trees.x, trees.y)
            own = zip(trees.x, trees.y, base, trees.height, trees.radius, strict=True)
            for (x, y, ground, height, radius), in_strip in zip(own, inside, strict=True):
                if in_strip:
                    east, north = x + self._origin[0], y + self._origin[1]
                    found.append(TrueTree(*map(float, (east, north, ground, height, radius))))
        return found

    def __iter__(self) -> Iterator[Stretch]:
        for index in range(len(self)):
            yield self.stretch(index)

    def stretches(self, workers: int = 1) -> Iterator[Stretch]:
        """All stretches in order, generated by ``workers`` threads, whose number does not change
        them.

        Up to ``workers`` + 2 stretches are in memory at a time.
        """
        if workers <= 1:
            yield from self
            return
        with ThreadPoolExecutor(workers) as pool:
            ahead: deque[Future[Stretch]] = deque()
            for index in range(len(self)):
                ahead.append(pool.submit(self.stretch, index))
                if len(ahead) > workers + 1:
                    yield ahead.popleft().result()
            while ahead:
                yield ahead.popleft().result()

    def stretch(self, index: int) -> Stretch:
        """Stretch ``index``; it does not depend on which others are generated."""
        (made,) = self.stretch_at(index, [self.settings.annotation_noise])
        return made

    def stretch_at(self, index: int, strengths: Sequence[float]) -> list[Stretch]:
        """Stretch ``index`` with labels for each of ``strengths`` of annotation noise.

        The points are the same in all. Each result equals that of a corridor with this
        ``annotation_noise``.
        """
        settings = self.settings
        rng = stream(settings.seed, STRETCH, index)
        before, after = self.line.support(index), self.line.support(index + 1)
        flight = flight_of(settings, int(self.line.flight[index]))
        parts: list[Coded] = []
        for number, strip in enumerate(self.line.strips(index)):
            parts += self._strip_points(index, number, strip, before, after, flight, rng)
        if index < settings.towers:
            parts.append(self._tower_points(after, flight, rng))
            if after.tension:
                parts.append(jumper_points(after, flight, settings, rng))
        xyz = np.concatenate([points for points, _ in parts])
        truth = np.concatenate([codes for _, codes in parts])
        ends = [(index, before), (index + 1, after)]
        near = [(number, tower) for number, tower in ends if 1 <= number <= settings.towers]
        if settings.section == 1:
            kept = _within(xyz, [tower for _, tower in near], settings.margin)
            xyz, truth = xyz[kept], truth[kept]
        ground = self._ground_near(near)
        labels = [
            annotate(xyz, truth, near, ground, strength, settings.seed, deepcopy(rng))
            for strength in strengths
        ]
        xyz += self._origin
        return [Stretch(index, xyz, each, truth) for each in labels]

    def _strip_points(
        self,
        index: int,
        number: int,
        strip: Strip,
        before: Support,
        after: Support,
        flight: Flight,
        rng: np.random.Generator,
    ) -> list[Coded]:
        settings = self.settings
        bounds = strip.bounds(reach=WIDEST_CROWN_M)
        terrain = self.terrain.raster(bounds)
        trees = self._trees(strip, bounds)
        canopy = self._vegetation.canopy(bounds, trees)
        solid = Raster.covering(bounds, canopy.top.step)
        clutter = clutter_points(strip, terrain, solid, flight, settings, rng)
        ends = [(index, before), (index + 1, after)]
        feet = [(t.x, t.y, self._unmown(k)) for k, t in ends if 1 <= k <= settings.towers]
        cover = self._cover.within(bounds, canopy.top, feet)
        span = float(self.line.spans[index])
        return [
            self._scanner.scan(
                strip, flight, terrain, canopy, solid, cover, key=2 * index + number
            ),
            clutter,
            stray_points(strip, terrain, flight, settings, rng),
            conductor_points(strip, before, after, span, flight, settings, rng),
            other_cables(strip, terrain, flight, settings, rng),
        ]

    def _trees(self, strip: Strip, bounds: tuple[float, float, float, float]) -> Plants:
        """Trees with stems within bounds (``Vegetation.trees``) that keep clear of the line."""
        trees = self._vegetation.trees(bounds)
        across = strip.to_strip(trees.x, trees.y)[1]
        return keep_clear(trees, np.abs(across), self.settings.clearing)

    def _tower_points(self, tower: Support, flight: Flight, rng: np.random.Generator) -> Coded:
        settings = self.settings
        density = settings.tower_density * flight.solids
        points = sample(tower.structure.members, density, rng)
        points = place(points, tower.x, tower.y, tower.base, tower.azimuth)
        points += settings.ranging_noise * rng.standard_normal(points.shape)
        above = points[:, 2] >= self.terrain.height(points[:, 0], points[:, 1])
        return points[above], np.full(int(above.sum()), TOWER, np.uint8)

    def _unmown(self, number: int) -> float:
        """Share of low vegetation around tower ``number``, in both of its stretches."""
        settings = self.settings
        if settings.low_vegetation == 0:
            return 0.0
        return float(stream(settings.seed, FOOT, number).uniform(0.05, 0.6))

    def _ground_near(self, towers: list[tuple[int, Support]]) -> Raster:
        """Elevation of the ground around towers."""
        reach = 12.0 + max((np.abs(t.structure.attachments).max() for _, t in towers), default=0.0)
        x, y = ([getattr(tower, axis) for _, tower in towers] or [0.0] for axis in "xy")
        return self.terrain.raster((min(x) - reach, min(y) - reach, max(x) + reach, max(y) + reach))


def _within(xyz: np.ndarray, towers: Sequence[Support], radius: float) -> np.ndarray:
    """(N,) bool: which points are within a planar distance in m of one of ``towers``."""
    apart = [np.hypot(xyz[:, 0] - tower.x, xyz[:, 1] - tower.y) for tower in towers]
    return np.min(apart, axis=0, initial=np.inf) <= radius


def _crs(epsg: int) -> pyproj.CRS:
    try:
        crs = pyproj.CRS.from_epsg(epsg)
    except pyproj.exceptions.CRSError as error:
        raise InputError(
            f"there is no coordinate reference system EPSG:{epsg}", place="epsg"
        ) from error
    if not crs.is_projected:
        raise InputError(
            f"EPSG:{epsg} ({crs.name}) is not projected",
            place="epsg",
            remedy="Use a projected CRS in metres, such as 32629",
        )
    return crs


def make_corridor(settings: SyntheticSettings) -> Corridor:
    """The corridor of ``settings``.

    Raises:
        InputError: the EPSG code is not that of a projected CRS.
    """
    return Corridor(settings)


def corridor_cloud(
    settings: SyntheticSettings,
) -> tuple[PointCloud, np.ndarray, list[TrueTower]]:
    """A whole corridor in memory.

    Returns:
        The cloud as annotated, the true class codes (N,) of its points, the true towers.
    """
    corridor = make_corridor(settings)
    parts = list(corridor)
    cloud = PointCloud(
        np.concatenate([part.xyz for part in parts]),
        np.concatenate([part.labels for part in parts]),
        EDP,
        corridor.crs,
    )
    return cloud, np.concatenate([part.truth for part in parts]), corridor.towers
