"""Crops: the surroundings of each tower (the ancillary dataset, thesis 5.1.3, Figure 5.3)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from pydantic import Field

from scenenet.core.progress import track
from scenenet.core.scratch import scratch_folder
from scenenet.core.settings import Settings
from scenenet.dataset.zarr_store import StoreReader, create
from scenenet.pointcloud import iter_chunks, read
from scenenet.pointcloud.class_schemes import class_scheme
from scenenet.pointcloud.cloud import PointCloud
from scenenet.pointcloud.ts40k import sample_files

_RECORD = np.dtype([("xyz", "<f8", 3), ("classification", "u1")])


class CropSettings(Settings):
    """Size of a crop."""

    radius_in_heights: float = Field(
        1.0, gt=0, description="planar radius of a crop, in heights of its tower (thesis: 1)"
    )


@dataclass(frozen=True)
class Crop:
    """One sample of the dataset.

    Attributes:
        id: unique name, SURVEY-NUMBER or SURVEY-SAMPLE.
        x, y: centre of its tower, m.
        radius: planar radius, m.
        towers: (T, 2) x and y of the centres of all labelled towers in the crop, m.
    """

    id: str
    x: float
    y: float
    radius: float
    towers: np.ndarray


def cut_crops(
    survey: str,
    path: str | Path,
    codes: str,
    towers: pd.DataFrame,
    settings: CropSettings,
    store: str | Path,
    manifest: str | Path,
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

    Returns:
        the manifest: ``crops`` has an entry for each crop; ``skipped`` lists the samples that were
        left out, with the reason.
    """
    facts: dict[str, Any] = {"survey": survey, "codes": codes, "crops": [], "skipped": []}
    samples = sample_files(path)
    clouds = (
        _samples(survey, samples, codes, towers, settings, facts["skipped"])
        if samples
        else _cut(survey, path, codes, towers, settings)
    )
    with create(store, manifest, facts) as writer:
        for crop, cloud in clouds:
            writer.add(crop.id, {"xyz": cloud.xyz, "classification": cloud.classification})
            facts["crops"].append(_entry(crop, len(cloud)))
    return facts


def read_crops(manifest: str | Path) -> Iterator[tuple[Crop, PointCloud]]:
    """The crops of a store, one at a time, without the CRS of the survey."""
    reader = StoreReader(manifest)
    scheme = class_scheme(reader.manifest["codes"])
    for entry in reader.manifest["crops"]:
        arrays = reader.get(entry["id"])
        cloud = PointCloud(arrays["xyz"], arrays["classification"], scheme)
        yield crop_of(entry), cloud


def crop_of(entry: dict[str, Any]) -> Crop:
    """The crop that an entry of a manifest describes."""
    towers = np.asarray(entry["towers"], float).reshape(-1, 2)
    return Crop(entry["id"], entry["x"], entry["y"], entry["radius"], towers)


def _entry(crop: Crop, points: int) -> dict[str, Any]:
    return {
        "id": crop.id,
        "x": crop.x,
        "y": crop.y,
        "radius": crop.radius,
        "towers": crop.towers.tolist(),
        "points": points,
    }


def _cut(
    survey: str, path: str | Path, codes: str, towers: pd.DataFrame, settings: CropSettings
) -> Iterator[tuple[Crop, PointCloud]]:
    centres = towers[["x", "y"]].to_numpy(float)
    radii = towers["height"].to_numpy(float) * settings.radius_in_heights
    scheme = class_scheme(codes)
    with scratch_folder() as folder:
        spools = [folder / f"{number}" for number in towers["tower"]]
        for spool in spools:
            spool.touch()
        for chunk in track(iter_chunks(path, codes), f"{survey}: chunks read"):
            for centre, radius, spool in zip(centres, radii, spools, strict=True):
                _append(spool, chunk, centre, radius)
        for number, centre, radius, spool in zip(
            towers["tower"], centres, radii, spools, strict=True
        ):
            records = np.fromfile(spool, _RECORD)
            inside = np.linalg.norm(centres - centre, axis=1) <= radius
            x, y = centre.tolist()
            crop = Crop(f"{survey}-{number:04d}", x, y, float(radius), centres[inside])
            xyz = np.ascontiguousarray(records["xyz"])
            yield crop, PointCloud(xyz, records["classification"].copy(), scheme)


def _append(spool: Path, chunk: PointCloud, centre: np.ndarray, radius: float) -> None:
    """Append the points of ``chunk`` within the crop to its file."""
    offset = chunk.xyz[:, :2] - centre
    # The bounding square first: two comparisons exclude most chunks, which are far away.
    near = np.flatnonzero((np.abs(offset) <= radius).all(axis=1))
    near = near[(offset[near] ** 2).sum(axis=1) <= radius**2]
    if len(near) == 0:
        return
    records = np.empty(len(near), _RECORD)
    records["xyz"] = chunk.xyz[near]
    records["classification"] = chunk.classification[near]
    with spool.open("ab") as stream:
        stream.write(records.tobytes())


def _samples(
    survey: str,
    samples: list[Path],
    codes: str,
    towers: pd.DataFrame,
    settings: CropSettings,
    skipped: list[dict[str, str]],
) -> Iterator[tuple[Crop, PointCloud]]:
    for sample in track(samples, f"{survey}: samples"):
        cloud = read(sample, codes)
        found = towers[towers["sample"] == sample.stem]
        if len(found) == 0:
            skipped.append({"sample": sample.name, "reason": "it has no labelled tower"})
            continue
        main = found.loc[found["points"].idxmax()]
        radius = float(main["height"]) * settings.radius_in_heights
        centres = found[["x", "y"]].to_numpy(float)
        yield Crop(f"{survey}-{sample.stem}", main["x"], main["y"], radius, centres), cloud
