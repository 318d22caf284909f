"""Scores of a model on crops: voxels and towers (thesis 5.2.4).

The scores are defined in docs/development/architecture.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from scenenet.core.progress import track
from scenenet.dataset.crops import Crop
from scenenet.dataset.split import crops_in
from scenenet.dataset.voxel_cache import Dataset, load
from scenenet.dataset.voxels import VoxelSample
from scenenet.detection.settings import DetectionSettings
from scenenet.evaluation.crop_towers import detect_in_crop, match_crop
from scenenet.evaluation.result import Evaluation, SampleScores, TowerScores, VoxelScores
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
) -> Evaluation:
    """Scores of a tuned model on one part of the split (see ``score_predictions``)."""
    trained, card = read_model(model)
    dataset = load(voxel_manifests, crops_in(split, part))
    return replace(score(trained, card, dataset, detection), part=part)


def score(
    model: VoxelModel, card: ModelCard, dataset: Dataset, detection: DetectionSettings
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
) -> Evaluation:
    """Voxel and tower scores at tau over all samples, for any source of probabilities.

    Voxel scores come from the summed counts of all samples. All voxels of the grids count, empty
    ones included.

    Args:
        name, seed: of the model.
        predict: gives the probability (V,) and the label (V,) bool of every voxel of a sample.
        whole_towers: whether ``voxel`` and ``per_sample`` count whole towers
            (docs/method/detection.md).
    """
    tally = _Tally(tau, detection, whole_towers)
    pairs = list(zip(dataset.samples, dataset.crops, strict=True))
    for sample, crop in track(pairs, f"{name}: crops scored"):
        tally.add(sample, crop, *predict(sample))
    return tally.evaluation(name, seed)


class _Tally:
    """Sums of the counts of samples."""

    def __init__(self, tau: float, detection: DetectionSettings, whole_towers: bool) -> None:
        self._tau, self._detection, self._whole_towers = tau, detection, whole_towers
        self._observer, self._towers, self._occupied = Confusion(), Confusion(), Confusion()
        self._curve = ThresholdCurve.empty()
        self._match = TowerMatch(np.empty(0), 0, 0)
        self._samples: list[SampleScores] = []

    def add(
        self, sample: VoxelSample, crop: Crop, probability: np.ndarray, truth: np.ndarray
    ) -> None:
        """Count a sample with the probability (V,) and label (V,) bool of every voxel."""
        found = detect_in_crop(sample, probability, self._tau, self._detection)
        of_a_tower, _ = sample.spread(found.voxels)
        observer = confusion(probability, truth, self._tau)
        towers = confusion(of_a_tower, truth, 0.5)
        chosen, level = (of_a_tower, 0.5) if self._whole_towers else (probability, self._tau)
        match = match_crop(found.towers, crop)
        self._observer += observer
        self._towers += towers
        self._occupied += confusion(chosen[sample.index], truth[sample.index], level)
        self._curve += ThresholdCurve.of(probability, truth)
        self._match += match
        counts = towers if self._whole_towers else observer
        self._samples.append(_of_sample(sample, counts, match, observer.f05, towers.f05))

    def evaluation(self, name: str, seed: int | None) -> Evaluation:
        """The scores of all samples."""
        counts = self._towers if self._whole_towers else self._observer

        def scores(counts: Confusion) -> VoxelScores:
            return VoxelScores.of(counts, self._tau, len(self._samples))

        return Evaluation(
            model=name,
            seed=seed,
            alive=self._observer.tp > 0,
            whole_towers=self._whole_towers,
            voxel=scores(counts),
            voxel_observer=scores(self._observer),
            voxel_towers=scores(self._towers),
            voxel_trivial=scores(counts.without_predictions()),
            voxel_occupied=scores(self._occupied),
            towers=TowerScores.of(self._match),
            per_sample=tuple(self._samples),
            pr_curve=curve_columns(self._curve),
            average_precision=self._curve.average_precision(),
        )


def _of_sample(
    sample: VoxelSample,
    counts: Confusion,
    match: TowerMatch,
    f05_observer: float | None,
    f05_towers: float | None,
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
    )
