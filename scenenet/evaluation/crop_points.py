"""Points of crops with a tower id: each crop is predicted as a survey of its own."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np

from scenenet.core.progress import quiet, track
from scenenet.core.scratch import scratch_folder
from scenenet.dataset.crops import read_crops
from scenenet.detection.settings import DetectionSettings
from scenenet.evaluation.points import PointCounts
from scenenet.prediction.predict import predict_survey
from scenenet.prediction.settings import PredictSettings


def count_crop_points(
    model: str | Path,
    crop_manifests: Sequence[str | Path],
    ids: Collection[str],
    detection: DetectionSettings,
) -> dict[str, PointCounts]:
    """Counts of the points of crops by the id of the crop.

    A crop has no more surroundings than the tower is high, so a tower at its edge may be missed
    that is found in the whole survey.

    Args:
        model: model file with tau.
        crop_manifests: of the crop stores.
        ids: of the crops to count.
    """
    counts = {}
    with scratch_folder() as scratch:
        sample = scratch / "crop.npy"
        crops = (pair for path in crop_manifests for pair in read_crops(path))
        chosen = (pair for pair in crops if pair[0].id in ids)
        label = f"{Path(model).stem}: points of crops counted"
        for crop, cloud in track(chosen, label, total=len(ids)):
            np.save(sample, np.column_stack([cloud.xyz, cloud.classification]))
            with (
                quiet(),
                predict_survey(sample, model, PredictSettings(), detection) as prediction,
            ):
                in_tower = prediction.look_up(cloud.xyz).tower_id > 0
            counts[crop.id] = PointCounts.of(cloud, in_tower)
    return counts
