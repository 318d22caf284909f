"""Scores of a model on crops: voxels and towers (thesis 5.2.4).

The scores are defined in docs/development/architecture.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from scenenet.core.progress import track
from scenenet.dataset.split import crops_in
from scenenet.dataset.voxel_cache import Dataset, load
from scenenet.dataset.voxels import VoxelSample
from scenenet.detection.settings import DetectionSettings
from scenenet.evaluation.crop_towers import _match, find_in_crop
from scenenet.metrics.threshold_curve import ThresholdCurve, curve_columns
from scenenet.metrics.tower_matching import TowerMatch
from scenenet.metrics.voxel_scores import Confusion, confusion
from scenenet.models.base import VoxelModel
from scenenet.models.model_file import ModelCard, read_model
from scenenet.models.predictions import probabilities


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

    return score_answers(
        card.name,
        seed,
        card.threshold(),
        answer,
        dataset,
        detection,
        whole_towers=model.whole_towers,
    )


def score_answers(
    name: str,
    seed: int | None,
    tau: float,
    answer: Callable[[VoxelSample], tuple[np.ndarray, np.ndarray]],
    dataset: Dataset,
    detection: DetectionSettings,
    *,
    whole_towers: bool = False,
) -> dict[str, Any]:
    """Voxel and tower scores at tau over all samples, of whatever answers them.

    Voxel scores come from the counts of all samples together, and all voxels of the grids count,
    empty ones included. ``voxel_observer`` counts the voxels that reach tau, ``voxel_towers`` those
    of the towers found, body and all (docs/method/detection.md), and ``voxel`` is one of the two.
    ``voxel_occupied`` is ``voxel`` over the occupied voxels alone, ``voxel_trivial`` the model that
    never says tower, and ``alive`` says whether any tower voxel reaches tau.

    Args:
        name, seed: of the model.
        answer: probability (V,) and truth (V,) bool of every voxel of a sample's grid.
        whole_towers: whether ``voxel`` and ``per_sample`` are of whole towers.

    Returns:
        model, seed, alive, whole_towers, voxel, voxel_observer, voxel_towers, voxel_trivial,
        voxel_occupied, towers, per_sample, pr_curve and average_precision, all of plain numbers.
    """
    reached, whole, occupied = Confusion(), Confusion(), Confusion()
    curve = ThresholdCurve.empty()
    towers = TowerMatch(np.empty(0), 0, 0)
    per_sample = []
    pairs = list(zip(dataset.samples, dataset.crops, strict=True))
    for sample, crop in track(pairs, f"{name}: crops scored"):
        probability, truth = answer(sample)
        found, theirs = find_in_crop(sample, probability, tau, detection)
        said, _ = sample.spread(theirs)
        of_observer, of_towers = confusion(probability, truth, tau), confusion(said, truth, 0.5)
        reached += of_observer
        whole += of_towers
        chosen, level = (said, 0.5) if whole_towers else (probability, tau)
        counts = of_towers if whole_towers else of_observer
        occupied += confusion(chosen[sample.index], truth[sample.index], level)
        curve += ThresholdCurve.of(probability, truth)
        match = _match(found, crop)
        towers += match
        both = {"f05_observer": of_observer.f05, "f05_towers": of_towers.f05}
        per_sample.append(_sample_row(sample, counts, match) | both)
    shared = {"tau": tau, "n_samples": len(pairs)}
    every = whole if whole_towers else reached
    return {
        "model": name,
        "seed": seed,
        "alive": reached.tp > 0,
        "whole_towers": whole_towers,
        "voxel": every.scores() | shared,
        "voxel_observer": reached.scores() | shared,
        "voxel_towers": whole.scores() | shared,
        "voxel_trivial": every.without_predictions().scores() | shared,
        "voxel_occupied": occupied.scores() | shared,
        "towers": towers.scores(),
        "per_sample": per_sample,
        "pr_curve": curve_columns(curve),
        "average_precision": curve.average_precision(),
    }


def _sample_row(sample: VoxelSample, counts: Confusion, match: TowerMatch) -> dict[str, Any]:
    return {
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
