"""Crops for a target without a place of its own: squares of the ground plan that hold it.

A tower has a place, and a crop is its surroundings (``scenenet.dataset.crops``). A conductor or
vegetation extends over the survey, so the ground plan is cut into squares from the lower corner of
the survey, and each square with a labelled point is a crop with all points in it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from scenenet.core.errors import InputError
from scenenet.core.files import read_json
from scenenet.core.outputs import check_space
from scenenet.core.progress import track
from scenenet.core.scratch import scratch_folder, temporary_directory
from scenenet.dataset.crop_spool import append, spooled
from scenenet.dataset.crops import Crop, CropSpace, store_crops
from scenenet.dataset.square_settings import SquareSettings
from scenenet.pointcloud import iter_chunks, read, survey_info
from scenenet.pointcloud.class_schemes import class_scheme
from scenenet.pointcloud.cloud import PointCloud
from scenenet.pointcloud.point_fields import PointField
from scenenet.pointcloud.targets import Target
from scenenet.pointcloud.ts40k import sample_files


def cut_squares(
    survey: str,
    path: str | Path,
    codes: str,
    target: Target,
    settings: SquareSettings,
    store: str | Path,
    manifest: str | Path,
    truth: Path | None = None,
    fields: Sequence[PointField] = (),
) -> dict[str, Any]:
    """Write the squares of the ground plan that hold a point labelled ``target``.

    The survey is read twice, chunk by chunk: for the squares, and for their points, which are
    collected on disk. TS40K samples are crops already and are copied unchanged.

    Args:
        survey, path, codes, store, manifest: as ``scenenet.dataset.crops.cut_crops``.
        target: what the crops are for.
        settings: size of a square.
        truth: a file with the same points in the same order, with the true classes, or a folder
            with samples of the same names; None where the truth is not known.
        fields: what else is kept of each point, for measurements.

    Returns:
        the manifest: ``crops`` has an entry for each crop; ``skipped`` lists the files without a
        labelled point, with the reason.

    Raises:
        InputError: the survey cannot be read, or the points of the truth are not its points.
        OutputError: a disk has too little space.
    """
    space = CropSpace.of(path, fields)
    check_space({Path(store): space.stored, temporary_directory(): space.temporary})
    facts: dict[str, Any] = {"survey": survey, "codes": codes, "crops": [], "skipped": []}
    facts["target"] = target.text
    cut = _Cut(survey, codes, target, facts["skipped"], truth, fields)
    samples = sample_files(path)
    clouds = cut.samples(samples) if samples else cut.squares(Path(path), settings.edge)
    return store_crops(clouds, facts, store, manifest, target, fields)


def require_squares(manifests: Sequence[str | Path], observer: str, target: str) -> None:
    """Refuse to train an observer where no survey has a point of its target.

    Args:
        manifests: of the squares of each training survey.
        observer: its name.
        target: what it finds.

    Raises:
        InputError: names what each survey has instead.
    """
    facts = [read_json(manifest) for manifest in manifests]
    if any(each["crops"] for each in facts):
        return
    reasons = "; ".join(
        f"{entry['sample']}: {entry['reason']}" for each in facts for entry in each["skipped"]
    )
    raise InputError(
        f"no training survey has a point of {target}, so the observer {observer} has nothing to "
        f"learn from ({reasons})",
        remedy=f"Label these points, or train without it: take {observer} out of observers and of "
        "predict.observers in the configuration, which has it by default",
    )


class _Cut:
    """The cut of one survey; its arguments are those of ``cut_squares``."""

    def __init__(
        self,
        survey: str,
        codes: str,
        target: Target,
        skipped: list[dict[str, str]],
        truth: Path | None,
        fields: Sequence[PointField],
    ) -> None:
        self._survey, self._codes, self._target = survey, codes, target
        self._scheme, self._skipped, self._truth = class_scheme(codes), skipped, truth
        self._fields = fields

    def squares(self, path: Path, edge: float) -> Iterator[tuple[Crop, PointCloud]]:
        """The squares of ``edge`` m of a survey, row by row from its lower corner."""
        corner = np.array(survey_info(path).mins[:2])
        cells, counts = set[tuple[int, int]](), np.zeros(256, np.int64)
        for chunk in track(iter_chunks(path, self._codes), f"{path}: labels read"):
            counts += np.bincount(chunk.classification, minlength=256)
            own = chunk.xyz[chunk.is_labelled(self._target), :2]
            cells.update(map(tuple, np.unique(_cells(own, corner, edge), axis=0).tolist()))
        if not cells:
            self._skip(path, counts)
            return
        numbers = {cell: number for number, cell in enumerate(sorted(cells), start=1)}
        with scratch_folder() as folder:
            chunks = iter_chunks(path, self._codes, truth=self._truth, fields=self._fields)
            for chunk in track(chunks, f"{path}: chunks read"):
                for cell, rows in _grouped(_cells(chunk.xyz[:, :2], corner, edge)):
                    if cell in numbers:
                        append(folder / f"{numbers[cell]}", chunk, rows, self._fields)
            for (row, column), number in numbers.items():
                centre = corner + (np.array([column, row]) + 0.5) * edge
                cloud = spooled(
                    folder / f"{number}", self._scheme, self._truth is not None, self._fields
                )
                yield self._crop(f"{self._survey}-{number:04d}", centre, edge / 2), cloud

    def samples(self, samples: list[Path]) -> Iterator[tuple[Crop, PointCloud]]:
        """The TS40K samples with a labelled point."""
        for sample in track(samples, f"{self._survey}: samples"):
            folder = self._truth
            true = folder / sample.name if folder is not None and folder.is_dir() else folder
            cloud = read(sample, self._codes, true, self._fields)
            if not cloud.is_labelled(self._target).any():
                self._skip(sample, np.bincount(cloud.classification, minlength=256))
                continue
            low, high = cloud.xyz[:, :2].min(axis=0), cloud.xyz[:, :2].max(axis=0)
            half = float((high - low).max() / 2)
            yield self._crop(f"{self._survey}-{sample.stem}", (low + high) / 2, half), cloud

    def _crop(self, name: str, centre: np.ndarray, half: float) -> Crop:
        none = np.empty((0, 4))
        true = None if self._truth is None else none
        x, y = centre.tolist()
        return Crop(name, x, y, half, none, true, square=True)

    def _skip(self, path: Path, counts: np.ndarray) -> None:
        reason = self._target.none_labelled(self._scheme, counts)
        self._skipped.append({"sample": path.name, "reason": reason})


def _cells(xy: np.ndarray, corner: np.ndarray, edge: float) -> np.ndarray:
    """(N, 2) int64 row and column of the square of each point (N, 2)."""
    return np.floor((xy - corner) / edge).astype(np.int64)[:, ::-1]


def _grouped(cells: np.ndarray) -> Iterator[tuple[tuple[int, int], np.ndarray]]:
    """Each square among ``cells`` (N, 2), with its rows in their order."""
    found, inverse = np.unique(cells, axis=0, return_inverse=True)
    inverse = inverse.reshape(-1)  # numpy 2.0 gives (N, 1), later ones (N,)
    order = np.argsort(inverse, kind="stable")
    ends = np.cumsum(np.bincount(inverse, minlength=len(found)))[:-1]
    for cell, rows in zip(found.tolist(), np.split(order, ends), strict=True):
        yield (cell[0], cell[1]), rows
