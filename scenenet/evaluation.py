"""Scores of a model on crops: voxels and towers (thesis 5.2.4; docs/design.md, Definitions)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from scenenet.crops import Crop
from scenenet.detection import DetectionSettings, among, detect_towers
from scenenet.metrics import Confusion, ThresholdCurve, TowerMatch, confusion, match_towers
from scenenet.modelfile import ModelCard, read_model
from scenenet.models import VoxelModel
from scenenet.progress import track
from scenenet.split import crops_in
from scenenet.training import probabilities
from scenenet.tuning import curve_columns
from scenenet.voxel_store import Dataset, load
from scenenet.voxels import VoxelSample


def evaluate(
    model: str | Path,
    voxel_manifests: Sequence[str | Path],
    split: str | Path,
    detection: DetectionSettings,
    part: str = "test",
) -> dict[str, Any]:
    """Scores of a tuned model on one part of the split (see ``score``)."""
    trained, card = read_model(model)
    dataset = load(voxel_manifests, crops_in(split, part))
    return {"part": part} | score(trained, card, dataset, detection)


def score(
    model: VoxelModel, card: ModelCard, dataset: Dataset, detection: DetectionSettings
) -> dict[str, Any]:
    """Voxel and tower scores of a model at its tau over all samples (see ``score_answers``)."""
    seed = card.provenance.get("seed")

    def answer(sample: VoxelSample) -> tuple[np.ndarray, np.ndarray]:
        return probabilities(model, sample, card.measurement)

    return score_answers(card.name, seed, card.threshold(), answer, dataset, detection)


def score_answers(
    name: str,
    seed: int | None,
    tau: float,
    answer: Callable[[VoxelSample], tuple[np.ndarray, np.ndarray]],
    dataset: Dataset,
    detection: DetectionSettings,
) -> dict[str, Any]:
    """Voxel and tower scores at tau over all samples, of whatever answers them.

    Voxel scores come from the counts of all samples together, and all voxels of the grids count,
    empty ones included. ``voxel_occupied`` counts the occupied voxels alone, ``voxel_trivial`` is
    the model that never says tower, and ``alive`` says whether the model found any tower voxel.

    Args:
        name, seed: of the model.
        answer: probability (V,) and truth (V,) bool of every voxel of a sample's grid.

    Returns:
        model, seed, alive, voxel, voxel_trivial, voxel_occupied, towers, per_sample, pr_curve and
        average_precision, all of plain numbers.
    """
    every, occupied = Confusion(), Confusion()
    curve = ThresholdCurve.empty()
    towers = TowerMatch(np.empty(0), 0, 0)
    per_sample = []
    pairs = list(zip(dataset.samples, dataset.crops, strict=True))
    for sample, crop in track(pairs, f"{name}: crops scored"):
        probability, truth = answer(sample)
        counts = confusion(probability, truth, tau)
        every += counts
        occupied += confusion(probability[sample.index], truth[sample.index], tau)
        curve += ThresholdCurve.of(probability, truth)
        match = crop_towers(sample, crop, probability, tau, detection)
        towers += match
        per_sample.append(
            {
                "id": sample.id,
                **counts.scores(),
                "tp": counts.tp,
                "fp": counts.fp,
                "fn": counts.fn,
                "tn": counts.tn,
                "towers_true": match.n_true,
                "towers_predicted": match.n_predicted,
                "position_error_m": float(match.errors.min()) if len(match.errors) else None,
            }
        )
    shared = {"tau": tau, "n_samples": len(pairs)}
    return {
        "model": name,
        "seed": seed,
        "alive": every.tp > 0,
        "voxel": every.scores() | shared,
        "voxel_trivial": every.without_predictions().scores() | shared,
        "voxel_occupied": occupied.scores() | shared,
        "towers": towers.scores(),
        "per_sample": per_sample,
        "pr_curve": curve_columns(curve),
        "average_precision": curve.average_precision(),
    }


def crop_towers(
    sample: VoxelSample,
    crop: Crop,
    probability: np.ndarray,
    tau: float,
    detection: DetectionSettings,
) -> TowerMatch:
    """Towers found in a crop against the true ones.

    Args:
        probability: (V,) of every voxel of the sample's grid.
    """
    # A tower is made of points: a detected voxel that is empty has nothing to show a person.
    detected = sample.index[probability[sample.index] >= detection.threshold(tau)]
    found = detect_towers(
        sample.grid.centres(detected),
        probability[detected],
        among(sample.grid.centres(sample.index)),
        sample.grid.voxel_size,
        tau,
        detection,
    )
    return match_towers(np.array([[t.x, t.y] for t in found]), crop.towers)


def evaluate_black_box(
    voxel_manifests: Sequence[str | Path],
    split: str | Path,
    detection: DetectionSettings,
    seeds: Sequence[int],
    outs: Sequence[str | Path],
) -> None:
    """Train the black box from each seed, tune it on validation and score it on the test crops.

    Args:
        outs: JSON file of each seed: what ``score_answers`` says, and ``parameters``.
    """
    from scenenet import blackbox
    from scenenet.files import write_json

    parts = {
        part: load(voxel_manifests, crops_in(split, part))
        for part in ("train", "validation", "test")
    }
    for seed, out in zip(seeds, outs, strict=True):
        grown = blackbox.fit(parts["train"].samples, blackbox.BlackBoxSettings(), seed)
        model = blackbox.tune(grown, parts["validation"].samples)
        tau = model.threshold()
        scores = score_answers(
            "black box", seed, tau, model.probabilities, parts["test"], detection
        )
        write_json(out, {"part": "test", "parameters": model.n_parameters()} | scores)
