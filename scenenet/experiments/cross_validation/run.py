"""Cross-validation: every crop is a test crop once, because one split of a few crops says little.

tau is chosen on the training crops of the fold; nothing is chosen on the crops left out
(docs/method/baselines.md).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from scenenet.core.progress import track
from scenenet.dataset.crops import CropClouds
from scenenet.dataset.folds import folds
from scenenet.dataset.voxel_cache import Dataset, load
from scenenet.detection.settings import DetectionSettings
from scenenet.evaluation.answers import rules_on
from scenenet.experiments.cross_validation.summary import COUNTS
from scenenet.experiments.run_tables import write_runs
from scenenet.experiments.train_and_tune import train_and_tune
from scenenet.metrics.score_columns import AT_TAU, SCORES, TRUTH, WHOLE_TOWERS
from scenenet.metrics.voxel_scores import Confusion
from scenenet.models.settings import BOOSTED_TREES, ModelSettings
from scenenet.pointcloud import PointCloud

COLUMNS = (
    "model", "voxels", "seed", "fold", "crops", "training_crops", "alive", "tau",
    *(f"{TRUTH}{name}" for name in (*SCORES, *COUNTS)), *SCORES, *COUNTS,
    "training_f05", "parameters",
)  # fmt: skip


def cross_validate(
    voxel_manifests: Sequence[str | Path],
    crop_manifests: Sequence[str | Path],
    model: ModelSettings | None,
    seeds: Sequence[int],
    leave_out: int,
    neighbour: float,
    detection: DetectionSettings,
    out: str | Path,
    out_times: str | Path,
) -> pd.DataFrame:
    """Train one model from every seed on every fold and score it on the crops left out.

    There are two rows per training (column ``voxels``): one counts the voxels at or above tau, the
    other the voxels of whole towers. Crops whose truth is known are scored against it as well;
    models are trained and tau is chosen on labels alone.

    Args:
        voxel_manifests, crop_manifests: of the stores of voxels, and of the crops they are of.
        model: what to train; None for the boosted trees.
        seeds: of the trainings.
        leave_out, neighbour: as for ``scenenet.dataset.folds.folds``.
        detection: what makes a tower; the same for every model.
        out: CSV file, columns ``COLUMNS``; ``training_f05`` is on the crops that tau was chosen on.
        out_times: CSV file, columns model, seed, fold and training_seconds (s).

    Returns:
        the table of scores.

    Raises:
        InputError: there are too few crops, or no training crop has a tower.
    """
    data, clouds = load(voxel_manifests), CropClouds(crop_manifests)
    rows = run_folds(data, clouds, model, seeds, leave_out, neighbour, detection)
    return write_runs(rows, COLUMNS, ("model", "seed", "fold"), out, out_times)


def run_folds(
    dataset: Dataset,
    clouds: Mapping[str, PointCloud],
    model: ModelSettings | None,
    seeds: Sequence[int],
    leave_out: int,
    neighbour: float,
    detection: DetectionSettings,
) -> list[dict[str, Any]]:
    """The rows of ``cross_validate``; ``clouds`` has the points of each crop by its id."""
    name = BOOSTED_TREES if model is None else model.name
    parts = folds(dataset.crops, leave_out, neighbour)
    plans = [(seed, number, fold) for seed in seeds for number, fold in enumerate(parts, start=1)]
    rows = []
    for seed, number, fold in track(plans, f"{name}: folds"):
        training = [dataset.samples[i] for i in fold.train]
        left_out = [dataset.samples[i] for i in fold.out]
        tuned = train_and_tune(model, training, [], seed)
        answer = rules_on(clouds, tuned.predict, tuned.tau, tuned.voxel_size, detection)
        answers = {sample.id: answer(sample) for sample in left_out}
        shared = {
            "model": name,
            "seed": seed,
            "fold": number,
            "crops": " ".join(sample.id for sample in left_out),
            "training_crops": len(training),
            "tau": tuned.tau,
            "training_f05": tuned.f05,
            "parameters": tuned.parameters,
            "training_seconds": tuned.seconds,
        }
        true = [one for s in left_out if (one := s.labelled_by_truth()) is not None]
        for voxels, count in (
            (AT_TAU, tuned.score),
            (WHOLE_TOWERS, partial(tuned.score_towers, answers=answers)),
        ):
            counts = count(left_out)
            own = {"voxels": voxels, "alive": counts.tp > 0}
            rows.append(
                shared | own | _cells(count(true) if true else None, TRUTH) | _cells(counts)
            )
    return rows


def _cells(counts: Confusion | None, start: str = "") -> dict[str, float | None]:
    """The columns of counts and their scores, whose names begin with ``start``; empty for None."""
    if counts is None:
        return {f"{start}{name}": None for name in (*SCORES, *COUNTS)}
    cells = counts.scores() | {name: getattr(counts, name) for name in COUNTS}
    return {f"{start}{name}": value for name, value in cells.items()}
