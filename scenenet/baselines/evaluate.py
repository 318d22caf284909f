"""Training, tuning and scoring of the boosted trees with several seeds."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from scenenet.baselines.boosted_trees import BoostedTrees, BoostedTreesSettings, fit_features, tune
from scenenet.baselines.voxel_features import voxel_features
from scenenet.core.progress import track
from scenenet.dataset.crops import CropClouds
from scenenet.dataset.split import crops_in
from scenenet.dataset.voxel_cache import Dataset, load
from scenenet.dataset.voxels import VoxelSample, median_voxel_size
from scenenet.detection.settings import DetectionSettings
from scenenet.evaluation.answers import Answering, Predict, no_answer, points_on, rules_on
from scenenet.evaluation.result import Evaluation
from scenenet.evaluation.scoring import score_predictions
from scenenet.metrics.threshold_choice import best_step
from scenenet.metrics.threshold_curve import ThresholdCurve
from scenenet.models.settings import BOOSTED_TREES, boosted_trees_of
from scenenet.pointcloud.targets import Target


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
    from scenenet.core.files import write_json
    from scenenet.core.peak_memory import used
    from scenenet.evaluation.inference_time import CROPS, milliseconds

    parts = _parts(voxel_manifests, split)
    clouds, size = CropClouds(crop_manifests), median_voxel_size(parts["train"].samples)
    grown, seconds = _grow(parts["train"].samples, seeds)
    models = [
        tune(model, curve)
        for model, curve in zip(grown, _curves(grown, parts["validation"].samples), strict=True)
    ]

    def answering(model: BoostedTrees, predict: Predict) -> Answering:
        """Towers are found in voxels of another size, which are predicted on their own."""
        if not crop_manifests:
            return no_answer
        return rules_on(clouds, model.probabilities, model.threshold(), size, detection)

    for out, scores in zip(
        outs, _scored(BOOSTED_TREES, models, parts["test"], answering), strict=True
    ):
        write_json(out, scores.to_json())
    timed = sorted(parts["test"].samples, key=lambda sample: sample.id)[:CROPS]
    inference_ms = {str(max(timed[0].grid.shape)): milliseconds(models[0].probabilities, timed)}
    write_json(out_times, {"training_seconds": seconds, "inference_ms": inference_ms} | used())


def evaluate_trees_of_observer(
    observer: str,
    target: Target,
    false_weight: float,
    voxel_manifests: Sequence[str | Path],
    crop_manifests: Sequence[str | Path],
    split: str | Path,
    seed: int,
    out: str | Path,
) -> None:
    """Train boosted trees for the target of an observer, on its squares; tune and score them on
    squares as the observer: by points in voxels at or above tau.

    Args:
        observer: its name.
        false_weight: what a false voxel counts where tau is chosen, as for the observer
            (``metric.false_weight``).
        voxel_manifests, crop_manifests: of the stores of voxels, and of the squares they are of.
        out: JSON file: the result of ``score_predictions``, with ``parameters``.
    """
    from scenenet.core.files import write_json

    parts = _parts(voxel_manifests, split)
    clouds = CropClouds(crop_manifests)
    (grown,), _ = _grow(parts["train"].samples, [seed])
    (curve,) = _curves([grown], parts["validation"].samples)
    step, _ = best_step(curve, false_weight)
    model = replace(grown, tau=float(curve.tau[step]))

    def answering(model: BoostedTrees, predict: Predict) -> Answering:
        return points_on(clouds, predict, model.threshold(), target)

    (scores,) = _scored(boosted_trees_of(observer), [model], parts["test"], answering)
    write_json(out, replace(scores, target=target.text).to_json())


def _parts(voxel_manifests: Sequence[str | Path], split: str | Path) -> dict[str, Dataset]:
    return {
        part: load(voxel_manifests, crops_in(split, part))
        for part in ("train", "validation", "test")
    }


def _scored(
    name: str,
    models: Sequence[BoostedTrees],
    test: Dataset,
    answering: Callable[[BoostedTrees, Predict], Answering],
) -> Iterator[Evaluation]:
    """The scores of each model on the test part.

    Args:
        name: of the models in their results.
        answering: the answer of a model for a crop, which may use its predictions.
    """
    samples = test.samples
    known = zip(samples, _of_each(models, samples), strict=True)
    found = {sample.id: of_each for sample, of_each in known}
    for number, model in enumerate(models):

        def predict(sample: VoxelSample, number: int = number) -> tuple[np.ndarray, np.ndarray]:
            return sample.spread(found[sample.id][number])

        answer, tau = answering(model, predict), model.threshold()
        scores = score_predictions(name, model.seed, tau, predict, test, answer)
        yield replace(scores, part="test", parameters=model.n_parameters())


def _grow(
    training: Sequence[VoxelSample], seeds: Sequence[int]
) -> tuple[list[BoostedTrees], list[float]]:
    """The trees of each seed, and the time (s) that each takes alone, features included."""
    begin = time.perf_counter()
    features = [voxel_features(sample) for sample in track(training, "boosted trees: features")]
    common, models, seconds = time.perf_counter() - begin, [], []
    towers = [sample.labelled for sample in training]
    for seed in track(seeds, "boosted trees: trainings"):
        begin = time.perf_counter()
        models.append(fit_features(features, towers, BoostedTreesSettings(), seed))
        seconds.append(common + time.perf_counter() - begin)
    return models, seconds


def _of_each(
    models: Sequence[BoostedTrees], samples: Sequence[VoxelSample]
) -> Iterator[list[np.ndarray]]:
    """For each sample, (M,) the probability of its occupied voxels by each model. Features cost far
    more than trees, so they are computed once for all models."""
    for sample in track(samples, "boosted trees: crops predicted"):
        features = voxel_features(sample)
        yield [model.of_features(features) for model in models]


def _curves(models: Sequence[BoostedTrees], samples: Sequence[VoxelSample]) -> list[ThresholdCurve]:
    """The scores of each model on ``samples`` at every tau."""
    curves = [ThresholdCurve.empty() for _ in models]
    for sample, found in zip(samples, _of_each(models, samples), strict=True):
        for number, known in enumerate(found):
            curves[number] += ThresholdCurve.of(*sample.spread(known))
    return curves
