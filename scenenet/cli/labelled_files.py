"""Training and scoring with labelled files, without the workflow."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from scenenet.core.errors import InputError
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
        skipped: files or samples without a crop, with the reason.
    """

    dataset: Dataset
    parts: dict[str, str]
    surveys: dict[Path, pd.DataFrame]
    survey_crops: set[str]
    skipped: list[dict[str, str]]


def read_labelled(
    paths: Sequence[str | Path],
    codes: str,
    grid: VoxelSettings,
    split: SplitSettings | None = None,
) -> LabelledFiles:
    """Cut crops around the labelled towers of files, and voxelise them.

    Args:
        paths: surveys (cut into crops around their towers), and TS40K samples or folders of them.
        codes: class scheme of the labels.
        split: the shares of the split; a single crop is not split.

    Raises:
        InputError: a file cannot be read.
    """
    surveys: dict[Path, pd.DataFrame] = {}
    survey_crops: set[str] = set()
    skipped: list[dict[str, str]] = []
    with tempfile.TemporaryDirectory(prefix="scenenet-") as scratch:
        crop_manifests, voxel_manifests = [], []
        for number, path in enumerate(map(Path, paths), start=1):
            folder = Path(scratch) / f"{number}"
            towers = survey_towers(path, codes, TowerSettings())
            # The number keeps files of the same name in different folders apart.
            name = path.stem if len(paths) == 1 else f"{number}-{path.stem}"
            crops, voxels = folder / "crops.json", folder / "voxels.json"
            facts = cut_crops(
                name, path, codes, towers, CropSettings(), folder / "crops.zarr.zip", crops
            )
            skipped += facts["skipped"]
            if not sample_files(path):
                surveys[path] = towers
                survey_crops |= {entry["id"] for entry in facts["crops"]}
                if len(towers) == 0:
                    skipped.append({"sample": path.name, "reason": "no labelled tower in it"})
            build(crops, grid, folder / "voxels.zarr.zip", voxels)
            crop_manifests.append(crops)
            voxel_manifests.append(voxels)
        dataset = load(voxel_manifests)
        parts = {}
        if split is not None and len(dataset.samples) > 1:
            table = split_crops(crop_manifests, split)
            parts = dict(zip(table["crop"], table["part"], strict=True))
    return LabelledFiles(dataset, parts, surveys, survey_crops, skipped)


def train_files(
    paths: Sequence[str | Path],
    codes: str,
    grid: VoxelSettings,
    settings: ModelSettings,
    tuning: TuningSettings,
    seeds: Sequence[int],
    validation: float,
    provenance: dict[str, Any],
    out: str | Path,
) -> dict[str, Any]:
    """Train with several seeds, tune each model on the validation crops, and write the best one.

    Args:
        validation: share of the crops for tuning. With 0 or a single crop, models are tuned on the
            training crops. The scores are then too high, and ``tuned_on`` is ``training``.

    Returns:
        the scores of each seed, the chosen seed, the numbers of crops, and the skipped files.

    Raises:
        InputError: a file cannot be read, or none has a labelled tower.
    """
    split = SplitSettings(train=1 - validation, validation=validation, test=0, neighbour=0)
    files = read_labelled(paths, codes, grid, split if validation > 0 else None)
    data = files.dataset
    _require_crops(data, paths)
    kept = [s for s in data.samples if files.parts.get(s.id) == "validation"]
    training = [s for s in data.samples if files.parts.get(s.id) != "validation"]
    candidates = []
    for seed in seeds:
        model, _ = fit(training, kept, settings, seed)
        card = card_of(replace(data, samples=training), settings, grid, seed, provenance)
        tuned, card, result = choose(
            model, card, kept or training, tuning, training if kept else ()
        )
        candidates.append((seed, tuned, card, result))
    seed, tuned, card, result = max(candidates, key=lambda entry: entry[3]["validation"]["f05"])
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
    }


def evaluate_files(
    paths: Sequence[str | Path],
    model: str | Path,
    codes: str,
    grid: VoxelSettings | None,
    detection: DetectionSettings,
) -> dict[str, Any]:
    """Scores of a model on labelled files.

    Args:
        grid: the grid for the voxel scores; None for the model's own voxel size. With None, towers
            are detected in whole surveys instead of crops around the labelled towers, so that
            false towers everywhere count, also in surveys without towers.

    Returns:
        the evaluation as plain values, with ``skipped``.

    Raises:
        InputError: a file cannot be read, or no file has a crop or survey to score.
    """
    trained, card = read_model(model)
    whole_surveys = grid is None
    grid = grid or VoxelSettings(fit="metric", voxel_size=card.voxel_size)
    files = read_labelled(paths, codes, grid)
    if not (whole_surveys and files.surveys):
        _require_crops(files.dataset, paths)
    result = score(trained, card, files.dataset, detection)
    if whole_surveys:
        match = TowerMatch(np.empty(0), 0, 0)
        for sample, crop in zip(files.dataset.samples, files.dataset.crops, strict=True):
            if sample.id not in files.survey_crops:
                probability, _ = probabilities(trained, sample, card.measurement)
                found = detect_in_crop(sample, probability, card.threshold(), detection)
                match += match_crop(found.towers, crop)
        for survey, towers in files.surveys.items():
            match += _survey_towers(survey, towers, model, detection)
        result = replace(result, towers=TowerScores.of(match))
    return result.to_json() | {"skipped": files.skipped}


def _survey_towers(
    survey: Path, towers: pd.DataFrame, model: str | Path, detection: DetectionSettings
) -> TowerMatch:
    """Match the towers detected in a whole survey with its labelled towers."""
    with predict_survey(survey, model, PredictSettings(), detection) as prediction:
        found = np.array([[tower.x, tower.y] for tower in prediction.towers])
    return match_towers(found, towers[["x", "y"]].to_numpy(float))


def _require_crops(dataset: Dataset, paths: Sequence[str | Path]) -> None:
    if not dataset.samples:
        raise InputError(
            "no labelled tower in it",
            file=", ".join(str(path) for path in paths),
            remedy="Check --codes, and that the points of towers are labelled 15",
        )
