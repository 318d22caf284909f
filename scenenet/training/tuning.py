"""The choice of tau and kernel size on the validation part (thesis 5.2.4.1, 5.2.7)."""

from __future__ import annotations

from collections.abc import Sequence

from scenenet.dataset.voxels import VoxelSample
from scenenet.metrics.threshold_curve import ThresholdCurve, curve_columns
from scenenet.metrics.voxel_scores import VoxelScores
from scenenet.models.base import VoxelModel
from scenenet.models.model_file import ModelCard
from scenenet.models.predictions import threshold_curve
from scenenet.models.settings import TuningSettings
from scenenet.training.tuning_result import TriedSize, Tuning


def choose(
    model: VoxelModel,
    card: ModelCard,
    validation: Sequence[VoxelSample],
    settings: TuningSettings,
    learnt: Sequence[VoxelSample] = (),
) -> tuple[VoxelModel, ModelCard, Tuning]:
    """The model at its best kernel size, its card with tau, and what was found.

    Args:
        learnt: crops that it was trained on. For a SCENE-Net in metres, tau is chosen on these as
            well: eleven numbers hardly overfit them, and a single validation crop is too little
            for the choice. The scores are still those of the validation part alone.
    """
    candidates: list[VoxelModel] = [model]
    candidates += model.with_kernel_sizes(settings.kernel_sizes)
    tried = []
    for candidate in candidates:
        tau, curve = tuned_tau(candidate, validation, learnt, card.measurement)
        tried.append((VoxelScores.of(curve.at(tau), tau, len(validation)), candidate, curve))
    # The size it was trained with comes first and wins a tie.
    scores, tuned, curve = max(tried, key=lambda entry: entry[0].decisive)
    sizes = tuple(TriedSize(candidate.kernel_size, found) for found, candidate, _ in tried)
    result = Tuning(card.name, tuned.kernel_size, scores, curve_columns(curve), sizes)
    return tuned, card.with_tau(result.tau), result


def tuned_tau(
    model: VoxelModel,
    validation: Sequence[VoxelSample],
    training: Sequence[VoxelSample],
    measurement: str,
) -> tuple[float, ThresholdCurve]:
    """tau, and the scores on ``validation`` at every tau.

    Args:
        training: crops the model was trained on; used where ``model.tau_from_training``.
    """
    curve = threshold_curve(model, validation, measurement)
    if not model.tau_from_training:
        return model.best_tau(curve), curve
    return model.best_tau(curve + threshold_curve(model, training, measurement)), curve
