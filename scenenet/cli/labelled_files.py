"""Labelled files as crops on grids, for commands that train and score without the workflow."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from scenenet.cli.inputs import Failures
from scenenet.core.errors import InputError, in_file, warn
from scenenet.core.outputs import check_space
from scenenet.core.scratch import temporary_directory
from scenenet.core.unchanged import unchanged
from scenenet.dataset.crops import (
    Crop,
    CropClouds,
    CropSettings,
    CropSpace,
    Truth,
    crop_of,
    cut_crops,
)
from scenenet.dataset.labelled_towers import LabelledTowers, TowerSettings, survey_towers
from scenenet.dataset.split import SplitSettings, split_crops
from scenenet.dataset.square_settings import SquareSettings
from scenenet.dataset.squares import cut_squares
from scenenet.dataset.voxel_cache import VOXEL_BYTES, Dataset, build, load
from scenenet.dataset.voxels import VoxelSample, VoxelSettings
from scenenet.evaluation.surveys import LabelledSurvey
from scenenet.measurement.registry import PRESENCE, measurement_named
from scenenet.pointcloud import PointCloud, class_scheme, iter_chunks, survey_in_metres
from scenenet.pointcloud.point_fields import PointField
from scenenet.pointcloud.quality.codes import codes_found
from scenenet.pointcloud.quality.screening import survey_warnings
from scenenet.pointcloud.reading import same_points
from scenenet.pointcloud.targets import TOWER, Target
from scenenet.pointcloud.ts40k import sample_files


@dataclass(frozen=True)
class LabelledFiles:
    """The content of labelled files.

    Attributes:
        dataset: their crops on grids.
        parts: part of each crop by its id; empty without a split or with a single crop.
        surveys: the surveys and TS40K samples, those without a crop included.
        read: the files that could be read.
        skipped: files or samples without a crop, and labelled points that are not tower, with the
            reason.
        warnings: what looks wrong about the files, as sentences that begin with the path.
        clouds: the points of each crop by its id, in the folder that they were written to.
    """

    dataset: Dataset = field(default_factory=lambda: Dataset([], [], "", []))
    parts: dict[str, str] = field(default_factory=dict)
    surveys: list[LabelledSurvey] = field(default_factory=list)
    read: list[Path] = field(default_factory=list)
    skipped: list[dict[str, str]] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    clouds: Mapping[str, PointCloud] = field(default_factory=dict)

    @property
    def validation(self) -> list[VoxelSample]:
        """The crops kept to tune models on."""
        return [s for s in self.dataset.samples if self.parts.get(s.id) == "validation"]

    @property
    def training(self) -> list[VoxelSample]:
        """The other crops."""
        return [s for s in self.dataset.samples if self.parts.get(s.id) != "validation"]


def read_labelled(
    paths: Sequence[Path],
    codes: str,
    grid: VoxelSettings,
    failures: Failures,
    scratch: Path,
    split: SplitSettings | None = None,
    truths: Sequence[Path] = (),
    target: Target = TOWER,
    squares: SquareSettings | None = None,
    measurement: str = PRESENCE,
) -> LabelledFiles:
    """Cut crops around the labelled towers of files, or squares that hold another target, and
    voxelise them.

    Args:
        paths: surveys (cut into crops), and TS40K samples or folders of them.
        codes: class scheme of the labels.
        failures: gets the errors of the files that cannot be read; the others are read.
        scratch: an empty folder, for the points of the crops.
        split: the shares of the split; a single crop is not split.
        truths: for each of ``paths`` a file with the same points in the same order, with the true
            classes, or a folder of such samples; empty where the truth is not known.
        target: what is labelled in the voxels.
        squares: size of a crop for another target than towers; the default if None.
        measurement: phi that is needed of the voxels.

    Raises:
        OutputError: the disk of the temporary files has too little space.
    """
    files = LabelledFiles()
    wanted = _Wanted(codes, grid, target, squares or SquareSettings(), measurement)
    pairs: list[tuple[Path, Path | None]] = [
        (path, truths[number] if truths else None) for number, path in enumerate(paths)
    ]
    seen = failures.look_at(dict.fromkeys(pairs), _look)
    stored = sum(space.stored + VOXEL_BYTES * space.points for space in seen.values())
    spooled = max((space.temporary for space in seen.values()), default=0)
    check_space({temporary_directory(): stored + spooled})
    manifests: list[tuple[Path, Path]] = []
    for number, (path, truth) in enumerate(pairs, start=1):
        if (path, truth) not in seen:
            continue
        # The number keeps files of the same name in different folders apart.
        name = path.stem if len(paths) == 1 else f"{number}-{path.stem}"
        used = [path] if truth is None else [path, truth]
        with failures.collect(), unchanged(*used), in_file(path):
            folder = scratch / f"{number}"
            manifests.append(_read_file(path, truth, name, wanted, folder, files))
    crops = [crops for crops, _ in manifests]
    dataset = load([voxels for _, voxels in manifests])
    parts = {}
    if split is not None and len(dataset.samples) > 1:
        table = split_crops(crops, split)
        parts = dict(zip(table["crop"], table["part"], strict=True))
    return replace(files, dataset=dataset, parts=parts, clouds=CropClouds(crops))


def _look(pair: tuple[Path, Path | None]) -> CropSpace:
    """Look at the headers and the unit of a survey and its truth, or for the files of samples.

    Raises:
        InputError: a file cannot be used.
    """
    path, truth = pair
    if truth is not None and path.is_dir() != truth.is_dir():
        kinds = ("a file", "a folder") if truth.is_dir() else ("a folder", "a file")
        raise InputError(f"the truth of {kinds[0]} cannot be {kinds[1]}", file=truth)
    if not sample_files(path):
        survey_in_metres(path)
    if truth is not None and not path.is_dir():
        same_points(path, truth)
    return CropSpace.of(path)


@dataclass(frozen=True)
class _Wanted:
    """What is wanted of labelled files: the arguments of ``read_labelled``."""

    codes: str
    grid: VoxelSettings
    target: Target
    squares: SquareSettings
    measurement: str

    @property
    def fields(self) -> tuple[PointField, ...]:
        """What else is read of each point."""
        return measurement_named(self.measurement).fields


def _read_file(
    path: Path,
    truth: Path | None,
    name: str,
    wanted: _Wanted,
    folder: Path,
    files: LabelledFiles,
) -> tuple[Path, Path]:
    """Add what a file holds to ``files``.

    Returns:
        the manifests of its crops and of their grids, in ``folder``.
    """
    warnings = survey_warnings(path, wanted.codes, wanted.target)
    crops, voxels = folder / "crops.json", folder / "voxels.json"
    cut = _cut_towers if wanted.target.is_tower else _cut_squares
    surveys = cut(path, truth, name, wanted, crops, files)
    warn(path, warnings)
    files.warnings.extend(f"{path}: {text}" for text in warnings)
    store = folder / "voxels.zarr.zip"
    build(crops, wanted.grid, store, voxels, measurement=wanted.measurement)
    files.read.append(path)
    files.surveys.extend(surveys)
    return crops, voxels


def _cut_towers(
    path: Path,
    truth: Path | None,
    name: str,
    wanted: _Wanted,
    crops: Path,
    files: LabelledFiles,
) -> list[LabelledSurvey]:
    """Cut the surroundings of the towers of a file into the manifest ``crops``."""
    codes = wanted.codes
    found = survey_towers(path, codes, TowerSettings())
    files.skipped.extend({"sample": path.name, "reason": note} for note in found.notes())
    standing = None
    if truth is not None:
        true = survey_towers(truth, codes, TowerSettings())
        files.skipped.extend(
            {"sample": path.name, "reason": f"in the truth, {note}"} for note in true.notes()
        )
        standing = Truth(truth, true.towers)
    store = crops.with_name("crops.zarr.zip")
    settings, fields = CropSettings(), wanted.fields
    facts = cut_crops(name, path, codes, found.towers, settings, store, crops, standing, fields)
    files.skipped.extend(facts["skipped"])
    if not sample_files(path) and len(found.towers) == 0:
        labelled = int(found.left_out["points"].sum())
        reason = f"no tower among its {labelled} points labelled tower"
        files.skipped.append({"sample": path.name, "reason": reason})
    cut = [crop_of(entry) for entry in facts["crops"]]
    return list(_surveys(path, name, wanted, found, standing, cut))


def _cut_squares(
    path: Path,
    truth: Path | None,
    name: str,
    wanted: _Wanted,
    crops: Path,
    files: LabelledFiles,
) -> list[LabelledSurvey]:
    """Cut the squares of a file that hold the target into the manifest ``crops``."""
    codes, target, store = wanted.codes, wanted.target, crops.with_name("crops.zarr.zip")
    how = wanted.squares, store, crops, truth, wanted.fields
    facts = cut_squares(name, path, codes, target, *how)
    files.skipped.extend(facts["skipped"])
    cut = [crop_of(entry) for entry in facts["crops"]]
    none = LabelledTowers.none()
    if sample_files(path):
        none.towers["sample"] = ""
    standing = None if truth is None else Truth(truth, none.towers)
    return list(_surveys(path, name, wanted, none, standing, cut))


def _surveys(
    path: Path,
    name: str,
    wanted: _Wanted,
    found: LabelledTowers,
    truth: Truth | None,
    crops: Sequence[Crop],
) -> Iterator[LabelledSurvey]:
    """The survey at ``path``, or each of its TS40K samples."""
    samples, facts = sample_files(path), (wanted.codes, wanted.target)
    if not samples:
        of_truth = () if truth is None else (truth.path, truth.towers)
        yield LabelledSurvey(path, *facts, found.towers, tuple(crops), False, *of_truth)
    for sample in samples:
        towers = found.towers[found.towers["sample"] == sample.stem]
        own = tuple(crop for crop in crops if crop.id == f"{name}-{sample.stem}")
        true = None if truth is None else truth.of_sample(sample)
        of_truth = () if truth is None or true is None else (true, truth.towers_in(true))
        yield LabelledSurvey(sample, *facts, towers, own, True, *of_truth)


def require_crops(
    files: LabelledFiles, paths: Sequence[Path], failures: Failures, target: Target, codes: str
) -> None:
    """End the command if there is no crop.

    Raises:
        typer.Exit: because files failed.
        InputError: because no file has a point labelled ``target`` in the scheme ``codes``.
    """
    if files.dataset.samples:
        return
    failures.end()
    reasons = "; ".join(f"{entry['sample']}: {entry['reason']}" for entry in files.skipped)
    own = sorted(target.codes_in(class_scheme(codes)))
    raise InputError(
        f"no labelled {target.name} in it ({reasons})",
        file=", ".join(str(path) for path in paths),
        remedy=f"Check --codes: in {codes} the points of {target.name} have the code "
        f"{' or '.join(map(str, own))}, and here are the codes {codes_found(_counts(paths))}",
    )


def _counts(paths: Sequence[Path]) -> np.ndarray:
    """(256,) points of each class code in files."""
    files = [file for path in paths for file in sample_files(path) or [path]]
    chunks = (chunk for file in files for chunk in iter_chunks(file))
    return sum(
        (np.bincount(chunk.classification, minlength=256) for chunk in chunks),
        np.zeros(256, np.int64),
    )
