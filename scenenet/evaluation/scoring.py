"""Scores of a model on crops: voxels and towers (thesis 5.2.4).

The scores are defined in docs/development/architecture.md.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path

import numpy as np

from scenenet.core.progress import track
from scenenet.dataset.crops import Crop
from scenenet.dataset.split import crops_in
from scenenet.dataset.voxel_cache import Dataset, load
from scenenet.dataset.voxels import VoxelSample
from scenenet.detection.settings import DetectionSettings
from scenenet.evaluation.crop_points import count_crop_points
from scenenet.evaluation.crop_towers import detect_in_crop, match_crop
from scenenet.evaluation.points import PointCounts
from scenenet.evaluation.result import (
    Evaluation,
    PointScores,
    SampleScores,
    Scores,
    TowerScores,
)
from scenenet.metrics.threshold_curve import ThresholdCurve, curve_columns
from scenenet.metrics.tower_matching import TowerMatch
from scenenet.metrics.voxel_scores import Confusion, VoxelScores, confusion
from scenenet.models.base import VoxelModel
from scenenet.models.model_file import ModelCard, read_model
from scenenet.models.predictions import probabilities


def evaluate(
    model: str | Path,
    voxel_manifests: Sequence[str | Path],
    split: str | Path,
    detection: DetectionSettings,
    part: str = "test",
    crop_manifests: Sequence[str | Path] = (),
) -> Evaluation:
    """Scores of a tuned model on one part of the split (see ``score_predictions``).

    Args:
        crop_manifests: of the crop stores, for the scores of points; without them there are none.
    """
    trained, card = read_model(model)
    ids = crops_in(split, part)
    points = None
    if crop_manifests:
        points = count_crop_points(model, crop_manifests, ids, detection)
    dataset = load(voxel_manifests, ids)
    return replace(score(trained, card, dataset, detection, points), part=part)


def score(
    model: VoxelModel,
    card: ModelCard,
    dataset: Dataset,
    detection: DetectionSettings,
    points: Mapping[str, PointCounts] | None = None,
) -> Evaluation:
    """Scores of a model at its tau over all samples (see ``score_predictions``)."""

    def predict(sample: VoxelSample) -> tuple[np.ndarray, np.ndarray]:
        return probabilities(model, sample, card.measurement)

    return score_predictions(
        card.name,
        card.provenance.get("seed"),
        card.threshold(),
        predict,
        dataset,
        detection,
        whole_towers=model.whole_towers,
        points=points,
    )


def score_predictions(
    name: str,
    seed: int | None,
    tau: float,
    predict: Callable[[VoxelSample], tuple[np.ndarray, np.ndarray]],
    dataset: Dataset,
    detection: DetectionSettings,
    *,
    whole_towers: bool = False,
    points: Mapping[str, PointCounts] | None = None,
) -> Evaluation:
    """Voxel and tower scores at tau over all samples, for any source of probabilities.

    Voxel scores come from the summed counts of all samples. All voxels of the grids count, empty
    ones included. Samples whose truth is known are scored against it as well.

    Args:
        name, seed: of the model.
        predict: gives the probability (V,) and the label (V,) bool of every voxel of a sample.
        whole_towers: whether ``voxel`` and ``per_sample`` count whole towers
            (docs/method/detection.md).
        points: counts of the points of each crop by its id; None if they were not counted.
    """
    tally = _Tally(tau, detection, whole_towers, points)
    pairs = list(zip(dataset.samples, dataset.crops, strict=True))
    for sample, crop in track(pairs, f"{name}: crops scored"):
        tally.add(sample, crop, *predict(sample))
    return tally.evaluation(name, seed)


class _Against:
    """Sums of the counts of samples against their labels, or against the truth."""

    def __init__(self, tau: float, whole_towers: bool) -> None:
        self._tau, self._whole_towers = tau, whole_towers
        self.observer, self._towers, self._occupied = Confusion(), Confusion(), Confusion()
        self._curve = ThresholdCurve.empty()
        self._match = TowerMatch.none()
        self._points: Confusion | None = None
        self.samples: list[SampleScores] = []

    def add(
        self,
        sample: VoxelSample,
        probability: np.ndarray,
        of_a_tower: np.ndarray,
        true: np.ndarray,
        match: TowerMatch,
        points: Confusion | None,
    ) -> None:
        """Count a sample.

        Args:
            probability: (V,) of every voxel.
            of_a_tower: (V,) whether it belongs to a detected tower.
            true: (V,) bool, whether it is tower.
            points: counts of its points; None if they were not counted.
        """
        observer = confusion(probability, true, self._tau)
        towers = confusion(of_a_tower, true, 0.5)
        chosen, level = (of_a_tower, 0.5) if self._whole_towers else (probability, self._tau)
        self.observer += observer
        self._towers += towers
        self._occupied += confusion(chosen[sample.index], true[sample.index], level)
        self._curve += ThresholdCurve.of(probability, true)
        self._match += match
        if points is not None:
            self._points = points + (self._points or Confusion())
        counts = towers if self._whole_towers else observer
        self.samples.append(_of_sample(sample, counts, match, observer.f05, towers.f05, points))

    def scores(self) -> Scores:
        """The scores of all samples."""
        counts = self._towers if self._whole_towers else self.observer

        def of(counts: Confusion) -> VoxelScores:
            return VoxelScores.of(counts, self._tau, len(self.samples))

        return Scores(
            voxel=of(counts),
            voxel_observer=of(self.observer),
            voxel_towers=of(self._towers),
            voxel_trivial=of(counts.without_predictions()),
            voxel_occupied=of(self._occupied),
            towers=TowerScores.of(self._match),
            points=None if self._points is None else PointScores.of(self._points),
            per_sample=tuple(self.samples),
            pr_curve=curve_columns(self._curve),
            average_precision=self._curve.average_precision(),
        )


class _Tally:
    """Sums of the counts of samples, against the labels and against the truth."""

    def __init__(
        self,
        tau: float,
        detection: DetectionSettings,
        whole_towers: bool,
        points: Mapping[str, PointCounts] | None,
    ) -> None:
        self._tau, self._detection, self._whole_towers = tau, detection, whole_towers
        self._of_points = points or {}
        self._labels, self._truth = _Against(tau, whole_towers), _Against(tau, whole_towers)
        self._points = PointCounts()

    def add(
        self, sample: VoxelSample, crop: Crop, probability: np.ndarray, labelled: np.ndarray
    ) -> None:
        """Count a sample with the probability (V,) and label (V,) bool of every voxel."""
        found = detect_in_crop(sample, probability, self._tau, self._detection)
        of_a_tower, _ = sample.spread(found.voxels)
        points = self._of_points.get(sample.id)
        self._points += points or PointCounts()
        match = match_crop(found.towers, crop.towers)
        counts = None if points is None else points.labels
        self._labels.add(sample, probability, of_a_tower, labelled, match, counts)
        true = sample.truth()
        if true is not None and crop.true_towers is not None:
            match = match_crop(found.towers, crop.true_towers)
            counts = None if points is None else points.truth
            self._truth.add(sample, probability, of_a_tower, true, match, counts)

    def evaluation(self, name: str, seed: int | None) -> Evaluation:
        """The scores of all samples."""
        labels = self._labels.scores()
        of_labels = self._points.labels_against_truth
        return Evaluation(
            **{field.name: getattr(labels, field.name) for field in fields(Scores)},
            model=name,
            seed=seed,
            alive=self._labels.observer.tp > 0,
            whole_towers=self._whole_towers,
            truth=self._truth.scores() if self._truth.samples else None,
            labels_against_truth=None if of_labels is None else PointScores.of(of_labels),
        )


def _of_sample(
    sample: VoxelSample,
    counts: Confusion,
    match: TowerMatch,
    f05_observer: float | None,
    f05_towers: float | None,
    points: Confusion | None,
) -> SampleScores:
    return SampleScores(
        id=sample.id,
        **counts.scores(),
        tp=counts.tp,
        fp=counts.fp,
        fn=counts.fn,
        tn=counts.tn,
        towers_true=match.n_true,
        towers_predicted=match.n_predicted,
        position_error_m=float(match.errors.min()) if len(match.errors) else None,
        f05_observer=f05_observer,
        f05_towers=f05_towers,
        points=None if points is None else PointScores.of(points),
    )
