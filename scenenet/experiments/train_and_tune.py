"""Training and tuning of SCENE-Net, CNN and boosted trees on the same crops.

The choice of tau differs (docs/method/baselines.md): a SCENE-Net in metres uses its training crops
as well, the boosted trees never do.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scenenet.baselines import boosted_trees
from scenenet.baselines.boosted_trees import BoostedTreesSettings
from scenenet.dataset.voxels import VoxelSample, median_voxel_size
from scenenet.evaluation.answers import Answer, Predict
from scenenet.metrics.threshold_curve import THRESHOLDS, ThresholdCurve
from scenenet.metrics.voxel_scores import Confusion, confusion
from scenenet.models.factory import new_model
from scenenet.models.predictions import probabilities
from scenenet.models.settings import ModelSettings
from scenenet.training.gradient import LostTraining
from scenenet.training.train import fit
from scenenet.training.tuning import tuned_tau


@dataclass(frozen=True)
class TunedModel:
    """A trained model with its threshold.

    Attributes:
        predict: probabilities and labels of a sample.
        tau: threshold.
        voxel_size: m, of the voxels in which a survey is predicted.
        f05: F0.5 at tau on the crops that tau was chosen on; 0 if it is not defined.
        parameters: number of trained parameters.
        seconds: time of training and tuning.
    """

    predict: Predict
    tau: float
    voxel_size: float
    f05: float
    parameters: int
    seconds: float

    def score(self, samples: Iterable[VoxelSample]) -> Confusion:
        """Counts over all voxels of ``samples``."""
        total = Confusion()
        for sample in samples:
            total += confusion(*self.predict(sample), self.tau)
        return total

    def score_towers(
        self, samples: Iterable[VoxelSample], answers: Mapping[str, Answer]
    ) -> Confusion:
        """Counts for the voxels of the whole towers that are found.

        Args:
            answers: with rules, by the id of the sample.
        """
        total = Confusion()
        for sample in samples:
            true = sample.labels()
            total += Confusion.of(answers[sample.id].among(len(true)), true)
        return total

    def curve(self, samples: Iterable[VoxelSample]) -> ThresholdCurve:
        """Scores over all voxels of ``samples`` at every tau."""
        total = ThresholdCurve.empty()
        for sample in samples:
            total += ThresholdCurve.of(*self.predict(sample))
        return total


def train_and_tune(
    settings: ModelSettings | None,
    training: Sequence[VoxelSample],
    validation: Sequence[VoxelSample],
    seed: int,
) -> TunedModel:
    """Train and tune one model.

    Args:
        settings: of the model; None for the boosted trees.
        training: crops to train on.
        validation: crops to choose tau on. If there are none, tau is chosen on the training crops,
            for the boosted trees by leaving out one of them at a time.
        seed: of the training.

    Raises:
        InputError: no training crop has a tower, or there is one crop for the boosted trees.
    """
    if settings is None:
        return train_boosted_trees(training, validation, seed)
    return train_model(settings, training, validation, seed)


def train_model(
    settings: ModelSettings,
    training: Sequence[VoxelSample],
    validation: Sequence[VoxelSample],
    seed: int,
) -> TunedModel:
    """Train a SCENE-Net or a CNN as ``train_and_tune``; if it diverges, it detects nothing."""
    begin, size = time.perf_counter(), median_voxel_size(training)
    try:
        model, _ = fit(training, [], settings, seed, with_evidence=False)
    except LostTraining as error:
        print(error, file=sys.stderr)
        n, seconds = new_model(settings, seed).n_parameters(), time.perf_counter() - begin
        return TunedModel(_nothing, float(THRESHOLDS[-1]), size, 0.0, n, seconds)
    others = training if validation else ()
    tau, curve = tuned_tau(model, validation or training, others, settings.measurement)
    counts = curve.at(tau)

    def predict(sample: VoxelSample) -> tuple[np.ndarray, np.ndarray]:
        return probabilities(model, sample, settings.measurement)

    return TunedModel(
        predict,
        tau,
        model.observed_size(size),
        counts.decisive,
        model.n_parameters(),
        time.perf_counter() - begin,
    )


def _nothing(sample: VoxelSample) -> tuple[np.ndarray, np.ndarray]:
    return sample.spread(np.zeros(len(sample.index), np.float32))


def train_boosted_trees(
    training: Sequence[VoxelSample], validation: Sequence[VoxelSample], seed: int = 0
) -> TunedModel:
    """Train boosted trees as ``train_and_tune``."""
    begin = time.perf_counter()
    settings = BoostedTreesSettings()
    if validation:
        grown = boosted_trees.fit(training, settings, seed)
        curve = boosted_trees.threshold_curve(grown, validation)
        model = boosted_trees.tune(grown, curve)
    else:
        model, curve = boosted_trees.fit_and_tune(training, settings, seed)
    seconds = time.perf_counter() - begin
    return TunedModel(
        model.probabilities,
        model.threshold(),
        median_voxel_size(training),
        curve.best()[1].decisive,
        model.n_parameters(),
        seconds,
    )
