"""A whole synthetic corridor, made stretch by stretch, and the survey files of it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyproj
import pyproj.exceptions

from scenenet.errors import InputError
from scenenet.files import write_json
from scenenet.pointcloud.cloud import PointCloud
from scenenet.pointcloud.schemes import EDP
from scenenet.progress import track
from scenenet.synthetic.annotation import annotate
from scenenet.synthetic.clutter import negatives, strays
from scenenet.synthetic.line import STRETCH, Line, Support
from scenenet.synthetic.noise import Raster, stream
from scenenet.synthetic.scan import TOWER, WIRE, scan_surface
from scenenet.synthetic.settings import SyntheticSettings
from scenenet.synthetic.structures import place, sample
from scenenet.synthetic.terrain import Terrain
from scenenet.synthetic.vegetation import WIDEST_CROWN_M, Vegetation, keep_clear
from scenenet.synthetic.wires import string_wires


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

    def stretch(self, index: int) -> Stretch:
        """Stretch ``index``, the same whichever others are made."""
        settings = self.settings
        rng = stream(settings.seed, STRETCH, index)
        strip = self.line.strip(index)
        before, after = self.line.support(index), self.line.support(index + 1)
        bounds = strip.bounds(reach=WIDEST_CROWN_M)
        terrain = self.terrain.raster(bounds)
        trees = self._vegetation.trees(bounds)
        across = strip.to_strip(trees.x, trees.y)[1]
        trees = keep_clear(trees, np.abs(across), settings.clearing)
        canopy = self._vegetation.canopy(bounds, trees)
        masts, mast_codes, solid = negatives(strip, terrain, bounds, settings, rng)
        parts = [
            scan_surface(strip, terrain, canopy, solid, settings, rng),
            strays(strip, terrain, settings, rng),
            (masts, mast_codes),
            self._wire_points(index, before, after, rng),
        ]
        if index < settings.towers:
            parts.append(_tower_points(after, terrain, settings, rng))
        xyz = np.concatenate([points for points, _ in parts])
        truth = np.concatenate([codes for _, codes in parts])
        ends = [(index, before), (index + 1, after)]
        near = [(number, tower) for number, tower in ends if 1 <= number <= settings.towers]
        labels = annotate(xyz, truth, near, terrain, settings.annotation_noise, settings.seed, rng)
        xyz += self._origin
        return Stretch(index, xyz, labels, truth)

    def _wire_points(
        self, index: int, before: Support, after: Support, rng: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        settings, strip = self.settings, self.line.strip(index)
        span = float(self.line.spans[index])
        window = (strip.low / span, strip.high / span)
        points = string_wires(
            before.attachments,
            after.attachments,
            settings.catenary,
            settings.wire_density,
            rng,
            window,
        )
        points += 0.5 * settings.ranging_noise * rng.standard_normal(points.shape)
        return points, np.full(len(points), WIRE, np.uint8)


def _tower_points(
    tower: Support, terrain: Raster, settings: SyntheticSettings, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    points = sample(tower.structure.members, settings.tower_density, rng)
    points = place(points, tower.x, tower.y, tower.base, tower.azimuth)
    points += settings.ranging_noise * rng.standard_normal(points.shape)
    above = points[:, 2] >= terrain.bilinear(points[:, 0], points[:, 1])
    return points[above], np.full(int(above.sum()), TOWER, np.uint8)


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
    cloud, truth = _gather(corridor, iter(corridor))
    return cloud, truth, corridor.towers


def _gather(corridor: Corridor, stretches: Iterator[Stretch]) -> tuple[PointCloud, np.ndarray]:
    parts = list(stretches)
    cloud = PointCloud(
        np.concatenate([part.xyz for part in parts]),
        np.concatenate([part.labels for part in parts]),
        EDP,
        corridor.crs,
    )
    return cloud, np.concatenate([part.truth for part in parts])


def make_survey(
    settings: SyntheticSettings,
    out: str | Path,
    truth: str | Path | None = None,
    towers: str | Path | None = None,
    progress: str | None = None,
) -> dict[str, Any]:
    """Make a corridor and write it as a survey.

    Args:
        out: LAS or LAZ file with the labels as annotated, EDP codes.
        truth: the same points in the same order with the labels before annotation noise.
        towers: GeoJSON, a point per true tower: id, x, y, base, height, type.
        progress: label under which progress is shown on stderr; None shows none.

    Returns:
        Counts: points, towers, length_m, classes (code -> points), and mislabelled: the share of
        the points labelled tower that are none.

    Raises:
        InputError: a setting or path is at fault.
    """
    from scenenet.pointcloud import write_las

    corridor = make_corridor(settings)
    stretches = iter(corridor)
    if progress is not None:
        stretches = track(stretches, progress, total=len(corridor))
    cloud, true_classes = _gather(corridor, stretches)
    write_las(out, cloud)
    if truth is not None:
        write_las(truth, PointCloud(cloud.xyz, true_classes, EDP, corridor.crs))
    found = corridor.towers
    if towers is not None:
        write_json(towers, towers_geojson(found, settings.epsg))
    labelled = cloud.classification == TOWER
    codes, counts = np.unique(cloud.classification, return_counts=True)
    return {
        "points": len(cloud),
        "towers": len(found),
        "length_m": round(corridor.length, 1),
        "classes": {int(code): int(n) for code, n in zip(codes, counts, strict=True)},
        "mislabelled": round(float((true_classes[labelled] != TOWER).mean()), 4),
    }


def towers_geojson(towers: list[TrueTower], epsg: int) -> dict[str, Any]:
    """A GeoJSON feature collection with a point per tower; coordinates in the CRS it names."""
    features = []
    for tower in towers:
        properties = {
            "id": tower.id,
            "x": round(tower.x, 3),
            "y": round(tower.y, 3),
            "base": round(tower.base, 3),
            "height": round(tower.height, 3),
            "type": tower.type,
        }
        point = {"type": "Point", "coordinates": [properties["x"], properties["y"]]}
        features.append({"type": "Feature", "geometry": point, "properties": properties})
    crs = {"type": "name", "properties": {"name": f"urn:ogc:def:crs:EPSG::{epsg}"}}
    return {"type": "FeatureCollection", "crs": crs, "features": features}
