"""Training and scoring with labelled files, without the workflow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from scenenet.cli.inputs import Failures
from scenenet.core.errors import InputError, in_file, warn
from scenenet.core.scratch import scratch_folder
from scenenet.core.unchanged import unchanged
from scenenet.dataset.crops import CropSettings, cut_crops
from scenenet.dataset.labelled_towers import TowerSettings, survey_towers
from scenenet.dataset.split import SplitSettings, split_crops
from scenenet.dataset.voxel_cache import Dataset, build, load
from scenenet.dataset.voxels import VoxelSettings
from scenenet.detection.settings import DetectionSettings
from scenenet.evaluation.crop_towers import detect_in_crop, match_crop
from scenenet.evaluation.result import TowerScores
from scenenet.evaluation.scoring import score
from scenenet.metrics.tower_matching import TowerMatch, match_towers
from scenenet.models.model_file import read_model, write_model
from scenenet.models.predictions import probabilities
from scenenet.models.settings import ModelSettings, TuningSettings
from scenenet.pointcloud import survey_in_metres
from scenenet.pointcloud.quality.screening import survey_warnings
from scenenet.pointcloud.ts40k import sample_files
from scenenet.prediction.predict import predict_survey
from scenenet.prediction.settings import PredictSettings
from scenenet.training.train import card_of, fit
from scenenet.training.tuning import choose


@dataclass(frozen=True)
class LabelledFiles:
    """The content of labelled files.

    Attributes:
        dataset: their crops on grids.
        parts: part of each crop by its id; empty without a split or with a single crop.
        surveys: table of labelled towers of each survey, TS40K samples excluded.
        survey_crops: ids of the crops that were cut from surveys.
        read: the files that could be read.
        skipped: files or samples without a crop, and labelled points that are no tower, with the
            reason.
        warnings: what looks wrong about the files, as sentences that begin with the path.
    """

    dataset: Dataset = field(default_factory=lambda: Dataset([], [], "", []))
    parts: dict[str, str] = field(default_factory=dict)
    surveys: dict[Path, pd.DataFrame] = field(default_factory=dict)
    survey_crops: set[str] = field(default_factory=set)
    read: list[Path] = field(default_factory=list)
    skipped: list[dict[str, str]] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)


def read_labelled(
    paths: Sequence[Path],
    codes: str,
    grid: VoxelSettings,
    failures: Failures,
    split: SplitSettings | None = None,
) -> LabelledFiles:
    """Cut crops around the labelled towers of files, and voxelise them.

    Args:
        paths: surveys (cut into crops around their towers), and TS40K samples or folders of them.
        codes: class scheme of the labels.
        failures: gets the errors of the files that cannot be read; the others are read.
        split: the shares of the split; a single crop is not split.
    """
    files = LabelledFiles()
    seen = failures.look_at(paths, _look)
    with scratch_folder() as scratch:
        manifests: list[tuple[Path, Path]] = []
        for number, path in enumerate(paths, start=1):
            if path not in seen:
                continue
            # The number keeps files of the same name in different folders apart.
            name = path.stem if len(paths) == 1 else f"{number}-{path.stem}"
            with failures.collect(), unchanged(path), in_file(path):
                folder = scratch / f"{number}"
                manifests.append(_read_file(path, name, codes, grid, folder, files))
        dataset = load([voxels for _, voxels in manifests])
        parts = {}
        if split is not None and len(dataset.samples) > 1:
            table = split_crops([crops for crops, _ in manifests], split)
            parts = dict(zip(table["crop"], table["part"], strict=True))
    return replace(files, dataset=dataset, parts=parts)


def _look(path: Path) -> None:
    """Look at the header and the unit of a survey, or for the files of samples.

    Raises:
        InputError: the file cannot be used.
    """
    if not sample_files(path):
        survey_in_metres(path)


def _read_file(
    path: Path, name: str, codes: str, grid: VoxelSettings, folder: Path, files: LabelledFiles
) -> tuple[Path, Path]:
    """Add what a file holds to ``files``.

    Returns:
        the manifests of its crops and of their grids, in ``folder``.
    """
    found = survey_towers(path, codes, TowerSettings())
    warnings = survey_warnings(path, codes)
    warn(path, warnings)
    files.warnings.extend(f"{path}: {text}" for text in warnings)
    files.skipped.extend({"sample": path.name, "reason": note} for note in found.notes())
    crops, voxels = folder / "crops.json", folder / "voxels.json"
    facts = cut_crops(
        name, path, codes, found.towers, CropSettings(), folder / "crops.zarr.zip", crops
    )
    build(crops, grid, folder / "voxels.zarr.zip", voxels)
    files.read.append(path)
    files.skipped.extend(facts["skipped"])
    if not sample_files(path):
        files.surveys[path] = found.towers
        files.survey_crops.update(entry["id"] for entry in facts["crops"])
        if len(found.towers) == 0:
            labelled = int(found.left_out["points"].sum())
            reason = f"no tower among its {labelled} points labelled tower"
            files.skipped.append({"sample": path.name, "reason": reason})
    return crops, voxels


def train_files(
    paths: Sequence[Path],
    codes: str,
    grid: VoxelSettings,
    settings: ModelSettings,
    tuning: TuningSettings,
    seeds: Sequence[int],
    validation: float,
    provenance: dict[str, Any],
    out: str | Path,
    failures: Failures,
) -> dict[str, Any]:
    """Train with several seeds, tune each model on the validation crops, and write the best one.

    Args:
        validation: share of the crops for tuning. With 0 or a single crop, models are tuned on the
            training crops. The scores are then too high, and ``tuned_on`` is ``training``.

    Returns:
        the scores of each seed, the chosen seed, the numbers of crops, the skipped files,
        and what looks wrong about the files.

    Raises:
        InputError: no file has a labelled tower.
        typer.Exit: no file could be read.
    """
    split = SplitSettings(train=1 - validation, validation=validation, test=0, neighbour=0)
    files = read_labelled(paths, codes, grid, failures, split if validation > 0 else None)
    data = files.dataset
    _require_crops(files, paths, failures)
    kept = [s for s in data.samples if files.parts.get(s.id) == "validation"]
    provenance = provenance | {"files": [path.name for path in files.read]}
    training = [s for s in data.samples if files.parts.get(s.id) != "validation"]
    candidates = []
    for seed in seeds:
        model, _ = fit(training, kept, settings, seed)
        card = card_of(replace(data, samples=training), settings, grid, seed, provenance)
        tuned, card, result = choose(
            model, card, kept or training, tuning, training if kept else ()
        )
        candidates.append((seed, tuned, card, result))
    seed, tuned, card, result = max(
        candidates, key=lambda entry: entry[3]["validation"]["f05"] or 0.0
    )
    write_model(out, tuned, card)
    return {
        "model": str(out),
        "seed": seed,
        "tau": result["tau"],
        "kernel_size": result["kernel_size"],
        "tuned_on": "validation" if kept else "training",
        "scores": result["validation"],
        "seeds": [
            {"seed": s, "kernel_size": r["kernel_size"], **r["validation"]}
            for s, _, _, r in candidates
        ],
        "crops": {"training": len(training), "validation": len(kept)},
        "skipped": files.skipped,
        "warnings": files.warnings,
    }


def evaluate_files(
    paths: Sequence[Path],
    model: str | Path,
    codes: str,
    grid: VoxelSettings | None,
    detection: DetectionSettings,
    failures: Failures,
) -> dict[str, Any]:
    """Scores of a model on labelled files.

    Args:
        grid: the grid for the voxel scores; None for the model's own voxel size. With None, towers
            are detected in whole surveys instead of crops around the labelled towers, so that
            false towers everywhere count, also in surveys without towers.

    Returns:
        the evaluation as plain values, with ``skipped`` and ``warnings``.

    Raises:
        InputError: the model cannot be used, or no file has a crop or survey to score.
        typer.Exit: no file could be read.
    """
    trained, card = read_model(model)
    whole_surveys = grid is None
    grid = grid or VoxelSettings(fit="metric", voxel_size=card.voxel_size)
    files = read_labelled(paths, codes, grid, failures)
    if not (whole_surveys and files.surveys):
        _require_crops(files, paths, failures)
    result = score(trained, card, files.dataset, detection)
    if whole_surveys:
        match = TowerMatch(np.empty(0), 0, 0)
        for sample, crop in zip(files.dataset.samples, files.dataset.crops, strict=True):
            if sample.id not in files.survey_crops:
                probability, _ = probabilities(trained, sample, card.measurement)
                found = detect_in_crop(sample, probability, card.threshold(), detection)
                match += match_crop(found.towers, crop)
        for survey, towers in files.surveys.items():
            with failures.collect():
                match += _survey_towers(survey, towers, model, detection)
        result = replace(result, towers=TowerScores.of(match))
    return result.to_json() | {"skipped": files.skipped, "warnings": files.warnings}


def _survey_towers(
    survey: Path, towers: pd.DataFrame, model: str | Path, detection: DetectionSettings
) -> TowerMatch:
    """Match the towers detected in a whole survey with its labelled towers."""
    with predict_survey(survey, model, PredictSettings(), detection) as prediction:
        found = np.array([[tower.x, tower.y] for tower in prediction.towers])
    return match_towers(found, towers[["x", "y"]].to_numpy(float))


def _require_crops(files: LabelledFiles, paths: Sequence[Path], failures: Failures) -> None:
    """End the command if there is no crop.

    Raises:
        typer.Exit: because files failed.
        InputError: because no file has a labelled tower.
    """
    if files.dataset.samples:
        return
    failures.end()
    reasons = "; ".join(f"{entry['sample']}: {entry['reason']}" for entry in files.skipped)
    raise InputError(
        f"no labelled tower in it ({reasons})",
        file=", ".join(str(path) for path in paths),
        remedy="Check --codes, and that the points of towers are labelled 15",
    )
