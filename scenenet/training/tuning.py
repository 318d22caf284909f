"""The choice of tau and kernel size on the validation part (thesis 5.2.4.1, 5.2.7)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from scenenet.core.files import write_json
from scenenet.dataset.split import crops_in
from scenenet.dataset.voxel_cache import load
from scenenet.dataset.voxels import Measurement, VoxelSample
from scenenet.metrics.threshold_curve import ThresholdCurve, curve_columns
from scenenet.metrics.voxel_scores import VoxelScores
from scenenet.models.base import VoxelModel
from scenenet.models.model_file import ModelCard, read_model, write_model
from scenenet.models.predictions import threshold_curve
from scenenet.models.settings import TuningSettings
from scenenet.training.tuning_result import TriedSize, Tuning


def tune(
    model: str | Path,
    voxel_manifests: Sequence[str | Path],
    split: str | Path,
    settings: TuningSettings,
    out_model: str | Path,
    out_json: str | Path,
) -> Tuning:
    """Choose tau and kernel size by F0.5 on the validation part; write the tuned model and what was
    found (``Tuning.to_json``)."""
    trained, card = read_model(model)
    samples = load(voxel_manifests, crops_in(split, "validation")).samples
    learnt: Sequence[VoxelSample] = ()
    if trained.tau_from_training:
        learnt = load(voxel_manifests, crops_in(split, "train")).samples
    tuned, card, result = choose(trained, card, samples, settings, learnt)
    write_model(out_model, tuned, card)
    write_json(out_json, result.to_json())
    return result


def choose(
    model: VoxelModel,
    card: ModelCard,
    validation: Sequence[VoxelSample],
    settings: TuningSettings,
    learnt: Sequence[VoxelSample] = (),
) -> tuple[VoxelModel, ModelCard, Tuning]:
    """The model at its best kernel size, its card with tau, and the result of ``tune``.

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
    measurement: Measurement,
) -> tuple[float, ThresholdCurve]:
    """tau, and the scores on ``validation`` at every tau.

    Args:
        training: crops the model was trained on; used where ``model.tau_from_training``.
    """
    curve = threshold_curve(model, validation, measurement)
    if not model.tau_from_training:
        return model.best_tau(curve), curve
    return model.best_tau(curve + threshold_curve(model, training, measurement)), curve
