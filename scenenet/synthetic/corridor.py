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
from scenenet.pointcloud.class_schemes import EDP
from scenenet.pointcloud.cloud import PointCloud
from scenenet.synthetic.annotation_noise import annotate
from scenenet.synthetic.codes import TOWER
from scenenet.synthetic.returns.clutter import clutter_points
from scenenet.synthetic.returns.conductors import other_cables, wire_points
from scenenet.synthetic.returns.flight import Flight, flight_of
from scenenet.synthetic.returns.scan import Scanner
from scenenet.synthetic.returns.stray_returns import stray_points
from scenenet.synthetic.scene.ground_cover import GroundCover
from scenenet.synthetic.scene.line import FOOT, STRETCH, Line, Support
from scenenet.synthetic.scene.random_fields import Raster, stream
from scenenet.synthetic.scene.strip import Strip
from scenenet.synthetic.scene.terrain import Terrain
from scenenet.synthetic.scene.towers import place, sample
from scenenet.synthetic.scene.vegetation import WIDEST_CROWN_M, Vegetation, keep_clear
from scenenet.synthetic.settings import SyntheticSettings

Coded = tuple[np.ndarray, np.ndarray]
"""Points (N, 3) and their codes (N,)."""


@dataclass(frozen=True)
class TrueTower:
    """A tower of the corridor: what a detector should report.

    Attributes:
        id: 1, 2, ... along the line.
        x, y: centre of the foot, m, in the survey's CRS.
        base: elevation of the ground at the foot, m.
        height: from the foot to the top, m.
        type: kind of tower, see ``structures.KINDS``.
    """

    id: int
    x: float
    y: float
    base: float
    height: float
    type: str


@dataclass(frozen=True)
class Stretch:
    """The points of one stretch of the corridor.

    Attributes:
        index: 0, 1, ... along the line.
        xyz: (N, 3) float64, m, in the survey's CRS.
        labels: (N,) uint8 EDP codes as an annotator gives them.
        truth: (N,) uint8 EDP codes without annotation noise.
    """

    index: int
    xyz: np.ndarray
    labels: np.ndarray
    truth: np.ndarray


class Corridor:
    """A corridor that is made while one goes through it; memory is that of one stretch.

    Attributes:
        settings: what was asked for.
        crs: of all coordinates.
        length: along the line, m.
        towers: the true towers.
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
        found = []
        for number in range(1, self.settings.towers + 1):
            support = self.line.support(number)
            x, y = support.x + self._origin[0], support.y + self._origin[1]
            found.append(TrueTower(number, x, y, support.base, support.height, type=support.kind))
        return found

    def __iter__(self) -> Iterator[Stretch]:
        for index in range(len(self)):
            yield self.stretch(index)

    def stretches(self, workers: int = 1) -> Iterator[Stretch]:
        """All stretches in order, made by ``workers`` threads; the same whatever their number.

        As many stretches as there are workers, and two more, are in memory at a time.
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
        """Stretch ``index``, the same whichever others are made."""
        (made,) = self.stretch_at(index, [self.settings.annotation_noise])
        return made

    def stretch_at(self, index: int, strengths: Sequence[float]) -> list[Stretch]:
        """Stretch ``index`` as annotators of each of ``strengths`` label it.

        The points are the same ones in all, and each is what a corridor of that
        ``annotation_noise`` has.
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
        xyz = np.concatenate([points for points, _ in parts])
        truth = np.concatenate([codes for _, codes in parts])
        ends = [(index, before), (index + 1, after)]
        near = [(number, tower) for number, tower in ends if 1 <= number <= settings.towers]
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
        trees = self._vegetation.trees(bounds)
        across = strip.to_strip(trees.x, trees.y)[1]
        trees = keep_clear(trees, np.abs(across), settings.clearing)
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
            wire_points(strip, before, after, span, flight, settings, rng),
            other_cables(strip, terrain, flight, settings, rng),
        ]

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
            remedy="Name a CRS in metres, such as 32629",
        )
    return crs


def make_corridor(settings: SyntheticSettings) -> Corridor:
    """The corridor of ``settings``: its ``towers``, and its stretches to iterate over.

    Raises:
        InputError: the EPSG code names no projected CRS.
    """
    return Corridor(settings)


def corridor_cloud(
    settings: SyntheticSettings,
) -> tuple[PointCloud, np.ndarray, list[TrueTower]]:
    """A whole corridor in memory.

    Returns:
        The cloud as annotated, the true classes (N,) of its points, the true towers.
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
