"""Training, tuning and scoring of the boosted trees with several seeds."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from scenenet.dataset.crops import CropClouds
from scenenet.dataset.split import crops_in
from scenenet.dataset.voxel_cache import load
from scenenet.dataset.voxels import median_voxel_size
from scenenet.detection.settings import DetectionSettings
from scenenet.evaluation.answers import Answering, no_answer, rules_on
from scenenet.evaluation.scoring import score_predictions
from scenenet.models.settings import BOOSTED_TREES


def evaluate_boosted_trees(
    voxel_manifests: Sequence[str | Path],
    crop_manifests: Sequence[str | Path],
    split: str | Path,
    detection: DetectionSettings,
    seeds: Sequence[int],
    outs: Sequence[str | Path],
    out_times: str | Path,
) -> None:
    """Train boosted trees with each seed, tune them on validation and score them on test crops.

    Args:
        voxel_manifests, crop_manifests: of the stores of voxels, and of the crops they are of.
            Without crops, whole towers and points are not scored.
        outs: JSON file of each seed: the result of ``score_predictions``, with ``parameters``.
        out_times: JSON file: ``training_seconds`` of each seed, ``inference_ms`` by voxels per edge
            (``scenenet.evaluation.inference_time``), and ``peak_memory_mb`` of the whole call.
    """
    from scenenet.baselines import boosted_trees
    from scenenet.core.files import write_json
    from scenenet.core.peak_memory import used
    from scenenet.evaluation.inference_time import CROPS, milliseconds

    parts = {
        part: load(voxel_manifests, crops_in(split, part))
        for part in ("train", "validation", "test")
    }
    clouds, size = CropClouds(crop_manifests), median_voxel_size(parts["train"].samples)
    seconds: list[float] = []
    inference_ms: dict[str, float] = {}
    for seed, out in zip(seeds, outs, strict=True):
        begin = time.perf_counter()
        grown = boosted_trees.fit(
            parts["train"].samples, boosted_trees.BoostedTreesSettings(), seed
        )
        seconds.append(time.perf_counter() - begin)
        model = boosted_trees.tune(grown, parts["validation"].samples)
        tau = model.threshold()
        answer: Answering = no_answer
        if crop_manifests:
            answer = rules_on(clouds, model.probabilities, tau, size, detection)
        scores = score_predictions(
            BOOSTED_TREES, seed, tau, model.probabilities, parts["test"], answer
        )
        scores = replace(scores, part="test", parameters=model.n_parameters())
        write_json(out, scores.to_json())
        if not inference_ms:
            timed = sorted(parts["test"].samples, key=lambda sample: sample.id)[:CROPS]
            edge = str(max(timed[0].grid.shape))
            inference_ms = {edge: milliseconds(model.probabilities, timed)}
    write_json(out_times, {"training_seconds": seconds, "inference_ms": inference_ms} | used())
