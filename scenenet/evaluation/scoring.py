"""Scores of a model on crops: voxels and towers (thesis 5.2.4).

The scores are defined in docs/development/architecture.md.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path

import numpy as np

from scenenet.core.errors import InputError
from scenenet.core.progress import track
from scenenet.dataset.crops import Crop, CropClouds
from scenenet.dataset.split import crops_in
from scenenet.dataset.voxel_cache import Dataset, load
from scenenet.dataset.voxels import VoxelSample
from scenenet.detection.settings import DetectionSettings
from scenenet.evaluation.answers import (
    Answer,
    Answering,
    Predict,
    no_answer,
    points_on,
    rules_on,
)
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
from scenenet.pointcloud import PointCloud


def evaluate(
    model: str | Path,
    voxel_manifests: Sequence[str | Path],
    crop_manifests: Sequence[str | Path],
    split: str | Path,
    detection: DetectionSettings,
    part: str = "test",
) -> Evaluation:
    """Scores of a tuned model on one part of the split (see ``score_predictions``).

    Each crop is predicted as a survey of its own. It has no more surroundings than the tower is
    high, so a tower at its edge may be missed that is found in the whole survey.

    Args:
        voxel_manifests, crop_manifests: of the stores of voxels, and of the crops they are of.
            Without crops, whole towers and points are not scored.

    Raises:
        InputError: the model gives whole towers, and there are no crops.
    """
    trained, card = read_model(model)
    if trained.whole_towers and not crop_manifests:
        raise InputError(f"{card.name} gives whole towers, which need the crops", file=model)
    answer: Answering = no_answer
    if crop_manifests:
        answer = answer_of(trained, card, CropClouds(crop_manifests), detection)
    dataset = load(voxel_manifests, crops_in(split, part))
    return replace(score(trained, card, dataset, answer), part=part)


def predictor(model: VoxelModel, card: ModelCard) -> Predict:
    """The probabilities of a model."""
    return lambda sample: probabilities(model, sample, card.measurement)


def answer_of(
    model: VoxelModel,
    card: ModelCard,
    clouds: Mapping[str, PointCloud],
    detection: DetectionSettings,
) -> Callable[[VoxelSample], Answer]:
    """The whole towers that a tuned model finds in each crop whose points are in ``clouds`` by its
    id; of a model of another target, the points in voxels at or above tau."""
    predict, tau = predictor(model, card), card.threshold()
    if not card.finds.is_tower:
        return points_on(clouds, predict, tau, card.finds)
    size = model.observed_size(card.voxel_size)
    return rules_on(clouds, predict, tau, size, detection, card.measurement)


def score(
    model: VoxelModel,
    card: ModelCard,
    dataset: Dataset,
    answer: Answering,
) -> Evaluation:
    """Scores of a model at its tau over all samples (see ``score_predictions``)."""
    scores = score_predictions(
        card.name,
        card.provenance.get("seed"),
        card.threshold(),
        predictor(model, card),
        dataset,
        answer,
        whole_towers=model.whole_towers,
    )
    return replace(scores, target=card.target)


def score_predictions(
    name: str,
    seed: int | None,
    tau: float,
    predict: Predict,
    dataset: Dataset,
    answer: Answering,
    *,
    whole_towers: bool = False,
) -> Evaluation:
    """Scores of voxels, points and towers over all samples, for any source of probabilities.

    Voxel scores come from the summed counts of all samples. All voxels of the grids count, empty
    ones included. Samples whose truth is known are scored against it as well.

    Args:
        name, seed: of the model.
        answer: gives the whole towers of a crop (docs/method/detection.md).
        whole_towers: whether ``voxel`` and ``per_sample`` count whole towers.
    """
    tally = _Tally(tau, whole_towers)
    pairs = list(zip(dataset.samples, dataset.crops, strict=True))
    for sample, crop in track(pairs, f"{name}: crops scored"):
        tally.add(sample, crop, *predict(sample), answer(sample))
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
        true: np.ndarray,
        places: np.ndarray,
        answer: Answer | None,
        points: Confusion | None,
    ) -> None:
        """Count a sample.

        Args:
            probability: (V,) of every voxel.
            true: (V,) bool, whether it is tower.
            places: (T, 4) m, the towers, as in ``scenenet.dataset.crops.Crop``.
            answer: its whole towers; None if they were not looked for.
            points: counts of its points; None as ``answer``.
        """
        observer = confusion(probability, true, self._tau)
        chosen, towers, match = probability >= self._tau, Confusion(), TowerMatch.none()
        if answer is not None:
            of_a_tower = answer.among(len(true))
            towers = Confusion.of(of_a_tower, true)
            match = answer.match(places) or match
            chosen = of_a_tower if self._whole_towers else chosen
        self.observer += observer
        self._towers += towers
        self._occupied += Confusion.of(chosen[sample.index], true[sample.index])
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

    def __init__(self, tau: float, whole_towers: bool) -> None:
        self._whole_towers = whole_towers
        self._labels, self._truth = _Against(tau, whole_towers), _Against(tau, whole_towers)
        self._points = PointCounts()

    def add(
        self,
        sample: VoxelSample,
        crop: Crop,
        probability: np.ndarray,
        labelled: np.ndarray,
        answer: Answer | None,
    ) -> None:
        """Count a sample with the probability (V,) and label (V,) bool of every voxel."""
        points = None if answer is None else answer.points
        self._points += points or PointCounts()
        of_labels = None if points is None else points.labels
        self._labels.add(sample, probability, labelled, crop.towers, answer, of_labels)
        true = sample.truth()
        if true is not None and crop.true_towers is not None:
            of_truth = None if points is None else points.truth
            self._truth.add(sample, probability, true, crop.true_towers, answer, of_truth)

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
