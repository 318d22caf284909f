"""The choice of tau on the validation crops, and the answer there at that tau (thesis 5.2.7).

The seed of a model is chosen by the answer that users get: for a model that gives whole towers, by
their voxels.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from scenenet.core.files import write_json
from scenenet.dataset.crops import CropClouds
from scenenet.dataset.split import crops_in
from scenenet.dataset.voxel_cache import load
from scenenet.dataset.voxels import VoxelSample
from scenenet.detection.settings import DetectionSettings
from scenenet.evaluation.scoring import answer_of
from scenenet.metrics.voxel_scores import Confusion, VoxelScores
from scenenet.models.base import VoxelModel
from scenenet.models.model_file import ModelCard, read_model, write_model
from scenenet.models.settings import TuningSettings
from scenenet.pointcloud import PointCloud
from scenenet.training.tuning import choose
from scenenet.training.tuning_result import Tuning


def tune(
    model: str | Path,
    voxel_manifests: Sequence[str | Path],
    crop_manifests: Sequence[str | Path],
    split: str | Path,
    settings: TuningSettings,
    detection: DetectionSettings,
    out_model: str | Path,
    out_json: str | Path,
) -> Tuning:
    """Choose tau and kernel size by F0.5 on the validation part; write the tuned model and what was
    found (``Tuning.to_json``).

    Args:
        voxel_manifests, crop_manifests: of the stores of voxels, and of the crops they are of.
    """
    trained, card = read_model(model)
    samples = load(voxel_manifests, crops_in(split, "validation")).samples
    learnt: Sequence[VoxelSample] = ()
    if trained.tau_from_training:
        learnt = load(voxel_manifests, crops_in(split, "train")).samples
    tuned, card, result = choose(trained, card, samples, settings, learnt)
    result = with_answer(result, tuned, card, samples, CropClouds(crop_manifests), detection)
    write_model(out_model, tuned, card)
    write_json(out_json, result.to_json())
    return result


def with_answer(
    tuning: Tuning,
    model: VoxelModel,
    card: ModelCard,
    samples: Sequence[VoxelSample],
    clouds: Mapping[str, PointCloud],
    detection: DetectionSettings,
) -> Tuning:
    """The tuning with the scores of the whole towers that a tuned model finds in the crops it was
    tuned on; unchanged for a model that gives voxels.

    Args:
        clouds: the points of each crop by its id.
    """
    if not model.whole_towers:
        return tuning
    answer = answer_of(model, card, clouds, detection)
    counts = Confusion()
    for sample in samples:
        labelled = sample.labels()
        counts += Confusion.of(answer(sample).among(len(labelled)), labelled)
    return replace(tuning, whole_towers=VoxelScores.of(counts, tuning.tau, len(samples)))
