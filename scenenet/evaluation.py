"""Scores of a model on crops: voxels and towers (thesis 5.2.4; docs/design.md, Definitions)."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from scenenet.coarse import block_edge, coarsened
from scenenet.convolution import Occupancy
from scenenet.crops import Crop
from scenenet.detection import (
    DetectedTower,
    DetectionSettings,
    among,
    detect_towers,
    whole_tower,
)
from scenenet.metrics import Confusion, ThresholdCurve, TowerMatch, confusion, match_towers
from scenenet.modelfile import ModelCard, read_model
from scenenet.models import SceneNet, VoxelModel
from scenenet.progress import track
from scenenet.split import crops_in
from scenenet.training import probabilities
from scenenet.tuning import curve_columns
from scenenet.voxel_store import Dataset, load
from scenenet.voxels import VoxelGrid, VoxelSample


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

    whole = isinstance(model, SceneNet) and model.field is not None and model.field.whole_towers
    return score_answers(
        card.name, seed, card.threshold(), answer, dataset, detection, whole_towers=whole
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
    of the towers found, body and all (docs/towers.md), and ``voxel`` is one of the two.
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


def _match(found: Sequence[DetectedTower], crop: Crop) -> TowerMatch:
    return match_towers(np.array([[tower.x, tower.y] for tower in found]), crop.towers)


def find_in_crop(
    sample: VoxelSample, probability: np.ndarray, tau: float, detection: DetectionSettings
) -> tuple[list[DetectedTower], np.ndarray]:
    """The towers found in a crop, and which of its occupied voxels are theirs, (M,) bool.

    Args:
        probability: (V,) of every voxel of the sample's grid.
    """
    # A tower is made of points: a detected voxel that is empty has nothing to show a person.
    answers = probability[sample.index]
    size = sample.grid.voxel_size
    edge = block_edge(size)
    # Towers are measured in blocks of about a metre: finer voxels have gaps where points are few.
    blocks, block = coarsened(Occupancy.of_grids([sample.index], None, sample.grid.shape), edge)
    coarse = VoxelGrid(sample.grid.origin, size * edge, blocks.shape)
    highest = np.zeros(len(blocks.index), answers.dtype)
    np.maximum.at(highest, block, answers)
    detected = np.flatnonzero(highest >= detection.threshold(tau))
    places = coarse.centres(blocks.index)
    found = detect_towers(
        places[detected], highest[detected], among(places), coarse.voxel_size, tau, detection
    )
    centres = sample.grid.centres(sample.index)
    theirs = np.zeros(len(centres), bool)
    for tower in found:
        seen = np.zeros(len(places), bool)
        seen[detected[tower.voxels]] = True
        theirs |= seen[block] & (answers >= tau)
        theirs |= whole_tower(tower, centres, detection)
    return found, theirs


def crop_towers(
    sample: VoxelSample,
    crop: Crop,
    probability: np.ndarray,
    tau: float,
    detection: DetectionSettings,
) -> TowerMatch:
    """Towers found in a crop against the true ones; probability as in ``find_in_crop``."""
    found, _ = find_in_crop(sample, probability, tau, detection)
    return _match(found, crop)


def evaluate_black_box(
    voxel_manifests: Sequence[str | Path],
    split: str | Path,
    detection: DetectionSettings,
    seeds: Sequence[int],
    outs: Sequence[str | Path],
    out_times: str | Path,
) -> None:
    """Train the black box from each seed, tune it on validation and score it on the test crops.

    Args:
        outs: JSON file of each seed: what ``score_answers`` says, and ``parameters``.
        out_times: JSON file: ``training_seconds`` of each seed, ``inference_ms`` by voxels an edge
            (``scenenet.model_times``), ``peak_memory_mb`` of all of this.
    """
    from scenenet import blackbox
    from scenenet.files import write_json
    from scenenet.memory import used
    from scenenet.model_times import CROPS, milliseconds

    parts = {
        part: load(voxel_manifests, crops_in(split, part))
        for part in ("train", "validation", "test")
    }
    seconds: list[float] = []
    took: dict[str, float] = {}
    for seed, out in zip(seeds, outs, strict=True):
        begin = time.perf_counter()
        grown = blackbox.fit(parts["train"].samples, blackbox.BlackBoxSettings(), seed)
        seconds.append(time.perf_counter() - begin)
        model = blackbox.tune(grown, parts["validation"].samples)
        tau = model.threshold()
        scores = score_answers(
            "black box", seed, tau, model.probabilities, parts["test"], detection
        )
        write_json(out, {"part": "test", "parameters": model.n_parameters()} | scores)
        if not took:
            timed = sorted(parts["test"].samples, key=lambda sample: sample.id)[:CROPS]
            edge = str(max(timed[0].grid.shape))
            took = {edge: milliseconds(model.probabilities, timed)}
    write_json(out_times, {"training_seconds": seconds, "inference_ms": took} | used())
