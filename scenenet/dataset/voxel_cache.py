"""The voxel cache: the voxel samples of a survey's crops, computed once (thesis 5.1.4)."""

from __future__ import annotations

import time
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from scenenet.core.errors import InputError, in_file
from scenenet.core.outputs import check_space
from scenenet.core.progress import track
from scenenet.dataset.crops import Crop, crop_of, read_crops
from scenenet.dataset.tower_shapes import TowerShape, measure_shape
from scenenet.dataset.voxels import VoxelGrid, VoxelSample, VoxelSettings, voxelise
from scenenet.dataset.zarr_store import StoreReader, create
from scenenet.measurement.registry import PRESENCE
from scenenet.pointcloud.targets import TOWER, Target

VOXEL_BYTES = 3
"""Bytes that a point of a crop takes in a store; most measured: 2.7, on fine grids."""


def build(
    crops: str | Path,
    settings: VoxelSettings,
    store: str | Path,
    manifest: str | Path,
    shapes: bool = True,
    measurement: str = PRESENCE,
) -> dict[str, Any]:
    """Voxelise every crop of a survey.

    Args:
        crops: manifest of the survey's crops.
        settings: the grid.
        store: path of the ``.zarr.zip`` file to write.
        manifest: path of the JSON file to write, in the same folder.
        shapes: whether to measure the shapes of the towers, which takes 50 times as long as the
            voxels; only models with measured numbers need them.
        measurement: phi that is needed of the voxels. Those without fields of the points need
            nothing that is not always there.

    Returns:
        the manifest: ``samples`` has an entry for each crop with its grid, the numbers of occupied
        and tower voxels, the time that voxelisation took, s, and the shape of its tower
        (``scenenet.dataset.tower_shapes``).

    Raises:
        InputError: the crops do not match their manifest, or a crop cannot have the grid.
        OutputError: the disk has too little space.
    """
    reader = StoreReader(crops)
    points = sum(entry["points"] for entry in reader.manifest["crops"])
    check_space({Path(store): VOXEL_BYTES * points})
    facts: dict[str, Any] = {
        "survey": reader.manifest["survey"],
        "codes": reader.manifest["codes"],
        "grid": settings.model_dump(),
        "samples": [],
    }
    target = Target.parse(reader.manifest.get("target", TOWER.text))
    if not target.is_tower:
        facts["target"] = target.text
    entries = {entry["id"]: entry for entry in reader.manifest["crops"]}
    label = f"{facts['survey']}: voxels {settings.label}"
    with create(store, manifest, facts) as writer:
        for crop, cloud in track(read_crops(crops), label, total=len(entries)):
            begin = time.perf_counter()
            with in_file(place=f"crop {crop.id}"):
                sample = voxelise(cloud, settings.grid(cloud.xyz), crop.id, target, measurement)
            seconds = time.perf_counter() - begin
            shape = measure_shape(crop, cloud) if shapes and target.is_tower else None
            arrays = {"index": sample.index, "count": sample.count, "tower": sample.labelled}
            if sample.true is not None:
                arrays["true"] = sample.true
            if sample.total is not None:
                arrays["total"] = sample.total
            writer.add(crop.id, arrays)
            facts["samples"].append(
                entries[crop.id]
                | {
                    "origin": list(sample.grid.origin),
                    "voxel_size": sample.grid.voxel_size,
                    "shape": list(sample.grid.shape),
                    "occupied": len(sample.index),
                    "tower": int(sample.labelled.sum()),
                    "seconds": seconds,
                    "tower_shape": None if shape is None else shape.plain(),
                }
            )
    return facts


@dataclass(frozen=True)
class Dataset:
    """Voxel samples with the crops they were made from.

    Attributes:
        samples, crops: of the same length, in the same order.
        codes: class scheme of the labels; several are joined by ``+``.
        content: digests of the stores that the samples came from.
        target: what is labelled in the samples.
    """

    samples: list[VoxelSample]
    crops: list[Crop]
    codes: str
    content: list[str]
    target: Target = TOWER

    def only(self, ids: Collection[str]) -> Dataset:
        """The data set with the crops of ``ids`` alone."""
        rows = [row for row, sample in enumerate(self.samples) if sample.id in ids]
        samples, crops = [self.samples[row] for row in rows], [self.crops[row] for row in rows]
        return replace(self, samples=samples, crops=crops)


def load(manifests: Sequence[str | Path], ids: set[str] | None = None) -> Dataset:
    """Read the samples of some stores: all of them, or those with ``ids``.

    Raises:
        InputError: a store does not match its manifest, no store has a crop of ``ids``, or the
            stores have labels of several targets.
    """
    samples, crops, contents, codes = [], [], [], set()
    targets: dict[str, str | Path] = {}
    for path in manifests:
        reader = StoreReader(path)
        contents.append(reader.manifest["content"])
        codes.add(reader.manifest["codes"])
        targets.setdefault(reader.manifest.get("target", TOWER.text), path)
        for entry in reader.manifest["samples"]:
            if ids is not None and entry["id"] not in ids:
                continue
            grid = VoxelGrid(tuple(entry["origin"]), entry["voxel_size"], tuple(entry["shape"]))
            known = entry.get("tower_shape")
            shape = None if known is None else TowerShape(**known)
            arrays = reader.get(entry["id"])
            arrays["labelled"] = arrays.pop("tower")  # its name in stores of every version
            samples.append(VoxelSample(entry["id"], grid, **arrays, shape=shape))
            crops.append(crop_of(entry))
    if ids is not None and (missing := ids - {sample.id for sample in samples}):
        raise InputError(
            f"{len(missing)} crops of the split are in no store: {', '.join(sorted(missing)[:5])}",
            file=", ".join(str(path) for path in manifests),
            remedy="Run the split again, and voxelise all of its surveys",
        )
    if len(targets) > 1:
        raise InputError(
            f"their voxels have labels of several targets: {', '.join(sorted(targets))}",
            file=", ".join(str(path) for path in targets.values()),
            remedy="Cut and voxelise all surveys for one target",
        )
    target = Target.parse(next(iter(targets), TOWER.text))
    return Dataset(samples, crops, "+".join(sorted(codes)), contents, target)
