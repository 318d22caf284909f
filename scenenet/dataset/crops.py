"""Crops: the surroundings of each tower (the ancillary dataset, thesis 5.1.3, Figure 5.3)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from pydantic import Field

from scenenet.core.outputs import check_space
from scenenet.core.progress import track
from scenenet.core.scratch import scratch_folder, temporary_directory
from scenenet.core.settings import Settings
from scenenet.dataset.crop_spool import append, record_type, spooled
from scenenet.dataset.tower_places import TowerPlaces
from scenenet.dataset.zarr_store import StoreReader, create
from scenenet.pointcloud import iter_chunks, read, survey_info
from scenenet.pointcloud.class_schemes import class_scheme
from scenenet.pointcloud.cloud import PointCloud
from scenenet.pointcloud.point_fields import PointField, PointFields
from scenenet.pointcloud.targets import TOWER, Target
from scenenet.pointcloud.ts40k import sample_files

CROP_BYTES = 18
"""Bytes that a point takes in a store; most measured: 17.1. Between a tenth of the points of a
survey and all of them lay in crops."""
SAMPLE_BYTES = 16
"""Fewest bytes that a point takes in a TS40K sample: four numbers of float32."""


class CropSettings(Settings):
    """Size of a crop."""

    radius_in_heights: float = Field(
        1.0, gt=0, description="planar radius of a crop, in heights of its tower (thesis: 1)"
    )


@dataclass(frozen=True)
class CropSpace:
    """About how much the crops of a survey take, if every point lies in one crop.

    Attributes:
        points: the points; for TS40K samples, the most that their files can hold.
        stored: bytes in the store.
        temporary: bytes in temporary files while the crops are cut.
    """

    points: int
    stored: int
    temporary: int

    @classmethod
    def of(cls, path: str | Path, fields: Sequence[PointField] = ()) -> CropSpace:
        """For a survey, a TS40K sample or a folder of samples, with some fields of the points.

        Raises:
            InputError: the header of a survey cannot be read.
        """
        if samples := sample_files(path):
            points = sum(sample.stat().st_size for sample in samples) // SAMPLE_BYTES
            return cls(points, CROP_BYTES * points, 0)
        points = survey_info(path).n_points
        spooled_bytes = record_type(fields).itemsize
        stored = CROP_BYTES + spooled_bytes - record_type().itemsize
        return cls(points, stored * points, spooled_bytes * points)


@dataclass(frozen=True)
class Crop:
    """One sample of the dataset.

    Attributes:
        id: unique name, SURVEY-NUMBER or SURVEY-SAMPLE.
        x, y: its centre, that of its tower, m.
        radius: planar radius, m; half the edge of a square crop.
        towers: (T, 4) of all labelled towers in the crop, m: x and y of the centre, elevation of
            the ground under it and height above it, both NaN without ground points there.
        true_towers: the same of all true towers in the crop; None where the truth is not known.
        square: whether it is a square of the ground plan (``scenenet.dataset.squares``) instead of
            the surroundings of a tower.
    """

    id: str
    x: float
    y: float
    radius: float
    towers: np.ndarray
    true_towers: np.ndarray | None = None
    square: bool = False

    def inside(self, places: np.ndarray) -> np.ndarray:
        """Rows of the places (N, 2 or more) m in the crop."""
        x, y, radius = places[:, 0] - self.x, places[:, 1] - self.y, self.radius
        if self.square:
            return np.flatnonzero((x >= -radius) & (x < radius) & (y >= -radius) & (y < radius))
        # The bounding square first: comparisons exclude most points, which are far away.
        near = np.flatnonzero((np.abs(x) <= radius) & (np.abs(y) <= radius))
        return near[x[near] ** 2 + y[near] ** 2 <= radius**2]


@dataclass(frozen=True)
class Truth:
    """The truth of a labelled survey.

    Attributes:
        path: a file with the same points in the same order, with the true classes.
        towers: table of ``labelled_towers.survey_towers`` of this file.
    """

    path: Path
    towers: pd.DataFrame

    def of_sample(self, sample: Path) -> Path:
        """The file with the truth of a TS40K sample: the sample of the same name in a folder."""
        return self.path / sample.name if self.path.is_dir() else self.path

    def towers_in(self, sample: Path) -> pd.DataFrame:
        """The rows of ``towers`` of the file ``sample``, which is that of a TS40K sample."""
        if "sample" not in self.towers:  # the truth of the sample is a survey
            return self.towers
        return self.towers[self.towers["sample"] == sample.stem]


def cut_crops(
    survey: str,
    path: str | Path,
    codes: str,
    towers: pd.DataFrame,
    settings: CropSettings,
    store: str | Path,
    manifest: str | Path,
    truth: Truth | None = None,
    fields: Sequence[PointField] = (),
) -> dict[str, Any]:
    """Write every point within one tower height (planar) of each tower.

    The survey is read once, chunk by chunk, and crops are collected on disk, so that memory is
    bounded by one chunk and one crop. TS40K samples are crops already and are copied unchanged.

    Args:
        survey: name of the survey, the first part of each crop's id.
        path: the survey, a TS40K sample, or a folder of samples.
        codes: class scheme of its labels.
        towers: table of ``labelled_towers.survey_towers``.
        settings: size of a crop.
        store: path of the ``.zarr.zip`` file to write.
        manifest: path of the JSON file to write, in the same folder.
        truth: the truth of the survey; None where it is not known. A folder of samples has a
            folder with samples of the same names as its truth.
        fields: what else is kept of each point, for measurements.

    Returns:
        the manifest: ``crops`` has an entry for each crop; ``skipped`` lists the samples that were
        left out, with the reason.

    Raises:
        InputError: the survey cannot be read, or the points of the truth are not its points.
        OutputError: a disk has too little space.
    """
    space = CropSpace.of(path, fields)
    check_space({Path(store): space.stored, temporary_directory(): space.temporary})
    facts: dict[str, Any] = {"survey": survey, "codes": codes, "crops": [], "skipped": []}
    samples = sample_files(path)
    clouds = (
        _samples(survey, samples, codes, towers, settings, facts["skipped"], truth, fields)
        if samples
        else _cut(survey, path, codes, towers, settings, truth, fields)
    )
    return store_crops(clouds, facts, store, manifest, TOWER, fields)


def store_crops(
    clouds: Iterable[tuple[Crop, PointCloud]],
    facts: dict[str, Any],
    store: str | Path,
    manifest: str | Path,
    target: Target,
    fields: Sequence[PointField] = (),
) -> dict[str, Any]:
    """Write crops with their points.

    Args:
        clouds: the crops; a list that ``facts`` holds may grow while they are cut.
        facts: of the manifest, with an empty list ``crops``.
        store, manifest: as ``cut_crops``.
        target: what the crops are for.
        fields: of the points of ``clouds``.

    Returns:
        the manifest, as ``cut_crops``.
    """
    if fields:
        facts["fields"] = list(fields)
    with create(store, manifest, facts) as writer:
        for crop, cloud in clouds:
            arrays = {"xyz": cloud.xyz, "classification": cloud.classification}
            arrays |= {} if cloud.fields is None else cloud.fields.arrays()
            writer.add(crop.id, arrays | ({} if cloud.truth is None else {"truth": cloud.truth}))
            facts["crops"].append(_entry(crop, cloud, target))
    return facts


def read_crops(manifest: str | Path, step: int = 1) -> Iterator[tuple[Crop, PointCloud]]:
    """Every ``step``-th crop of a store, one at a time, without the CRS of the survey."""
    reader = StoreReader(manifest)
    for entry in reader.manifest["crops"][::step]:
        yield crop_of(entry), _cloud(reader, entry["id"])


class CropClouds(Mapping[str, PointCloud]):
    """The points of the crops of some stores by the id of the crop, read when they are needed.

    Args:
        manifests: of the crop stores.

    Raises:
        InputError: a store does not match its manifest.
    """

    def __init__(self, manifests: Iterable[str | Path]) -> None:
        self._readers: dict[str, StoreReader] = {}
        for manifest in manifests:
            reader = StoreReader(manifest)
            self._readers |= {entry["id"]: reader for entry in reader.manifest["crops"]}

    def __getitem__(self, crop: str) -> PointCloud:
        return _cloud(self._readers[crop], crop)

    def __iter__(self) -> Iterator[str]:
        return iter(self._readers)

    def __len__(self) -> int:
        return len(self._readers)


def _cloud(reader: StoreReader, crop: str) -> PointCloud:
    arrays = reader.get(crop)
    scheme = class_scheme(reader.manifest["codes"])
    fields = PointFields.of_arrays(arrays, reader.manifest.get("fields", ()))
    classes, truth = arrays["classification"], arrays.get("truth")
    return PointCloud(arrays["xyz"], classes, scheme, truth=truth, fields=fields)


def crop_of(entry: dict[str, Any]) -> Crop:
    """The crop that an entry of a manifest describes."""
    towers = np.asarray(entry["towers"], float).reshape(-1, 4)
    true = entry.get("true_towers")
    true_towers = None if true is None else np.asarray(true, float).reshape(-1, 4)
    place = entry["x"], entry["y"], entry["radius"]
    return Crop(entry["id"], *place, towers, true_towers, entry.get("square", False))


def _entry(crop: Crop, cloud: PointCloud, target: Target) -> dict[str, Any]:
    """The entry of a crop in the manifest. ``labelled`` is the number of its points labelled with
    the target, ``wrong`` how many of these are something else in truth, null where the truth is not
    known. Only square crops have ``square``."""
    labelled, true = cloud.is_labelled(target), cloud.is_truly(target)
    return {
        "id": crop.id,
        "x": crop.x,
        "y": crop.y,
        "radius": crop.radius,
        "towers": _plain(crop.towers),
        "true_towers": None if crop.true_towers is None else _plain(crop.true_towers),
        "points": len(cloud),
        "labelled": int(labelled.sum()),
        "wrong": None if true is None else int((labelled & ~true).sum()),
    } | ({"square": True} if crop.square else {})


def _plain(towers: np.ndarray) -> list[list[float | None]]:
    """Numbers as JSON holds them, in which NaN is null."""
    return [[None if np.isnan(value) else value for value in row] for row in towers.tolist()]


def _cut(
    survey: str,
    path: str | Path,
    codes: str,
    towers: pd.DataFrame,
    settings: CropSettings,
    truth: Truth | None,
    fields: Sequence[PointField],
) -> Iterator[tuple[Crop, PointCloud]]:
    centres = towers[["x", "y"]].to_numpy(float)
    radii = towers["height"].to_numpy(float) * settings.radius_in_heights
    scheme = class_scheme(codes)
    with scratch_folder() as folder:
        spools = [folder / f"{number}" for number in towers["tower"]]
        crops = [
            Crop(f"{survey}-{number:04d}", x, y, radius, np.empty((0, 4)))
            for number, (x, y), radius in zip(
                towers["tower"], centres.tolist(), radii.tolist(), strict=True
            )
        ]
        for spool in spools:
            spool.touch()
        chunks = iter_chunks(
            path, codes, truth=None if truth is None else truth.path, fields=fields
        )
        for chunk in track(chunks, f"{path}: chunks read"):
            for number in _reaching(chunk, centres, radii):
                append(spools[number], chunk, crops[number].inside(chunk.xyz), fields)
        for crop, centre, radius, spool in zip(crops, centres, radii, spools, strict=True):
            cloud = spooled(spool, scheme, truth is not None, fields)
            near = [
                _within(table, centre, radius)
                for table in (towers, *(() if truth is None else (truth.towers,)))
            ]
            found, true = _places(cloud, *near)
            yield replace(crop, towers=found, true_towers=true), cloud


def _within(towers: pd.DataFrame, centre: np.ndarray, radius: float) -> pd.DataFrame:
    """The rows of a table of towers within a planar distance in m of a place (2,)."""
    apart = np.linalg.norm(towers[["x", "y"]].to_numpy(float) - centre, axis=1)
    return towers[apart <= radius]


def _places(
    cloud: PointCloud, labelled: pd.DataFrame, true: pd.DataFrame | None = None
) -> tuple[np.ndarray, np.ndarray | None]:
    """``Crop.towers`` and ``Crop.true_towers`` of a crop with these points and towers."""
    towers, true_towers = TowerPlaces(labelled), None
    towers.add(cloud)
    if true is not None and (points := cloud.with_truth) is not None:
        found = TowerPlaces(true)
        found.add(points)
        true_towers = found.places()
    return towers.places(), true_towers


def _reaching(chunk: PointCloud, centres: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Numbers of the crops, with centres (C, 2) and radii (C,), that the bounding box of a chunk
    reaches: a line has hundreds of crops, and a chunk is near a few of them."""
    places = chunk.xyz[:, :2]
    low, high = places.min(axis=0), places.max(axis=0)
    reach = radii[:, None]
    return np.flatnonzero(((centres > low - reach) & (centres < high + reach)).all(axis=1))


def _samples(
    survey: str,
    samples: list[Path],
    codes: str,
    towers: pd.DataFrame,
    settings: CropSettings,
    skipped: list[dict[str, str]],
    truth: Truth | None,
    fields: Sequence[PointField],
) -> Iterator[tuple[Crop, PointCloud]]:
    for sample in track(samples, f"{survey}: samples"):
        true = None if truth is None else truth.of_sample(sample)
        cloud = read(sample, codes, true, fields)
        found = towers[towers["sample"] == sample.stem]
        if len(found) == 0:
            skipped.append({"sample": sample.name, "reason": "it has no labelled tower"})
            continue
        main = found.loc[found["points"].idxmax()]
        radius = float(main["height"]) * settings.radius_in_heights
        standing = None if truth is None or true is None else truth.towers_in(true)
        places = _places(cloud, found, standing)
        yield Crop(f"{survey}-{sample.stem}", main["x"], main["y"], radius, *places), cloud
