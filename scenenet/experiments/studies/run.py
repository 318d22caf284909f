"""Run a study: train and score every variant from every seed."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from scenenet.core.errors import InputError
from scenenet.core.progress import track
from scenenet.dataset.crops import CropClouds
from scenenet.dataset.split import SplitSettings, split_crops
from scenenet.dataset.voxels import VoxelSample, VoxelSettings, voxelise
from scenenet.evaluation.inference_time import CROPS, milliseconds
from scenenet.experiments.run_tables import write_runs
from scenenet.experiments.studies.settings import Plan, StudySettings
from scenenet.metrics.score_columns import SCORES
from scenenet.metrics.threshold_curve import ThresholdCurve
from scenenet.metrics.voxel_scores import Confusion
from scenenet.models.base import VoxelModel
from scenenet.models.factory import new_model
from scenenet.models.geneo_model import GeneoModel
from scenenet.models.predictions import probabilities, threshold_curve
from scenenet.models.settings import ModelSettings
from scenenet.training.gradient import LostTraining
from scenenet.training.train import fit

COLUMNS = (
    "variant", "seed", "kind", "alive", "tau", *SCORES,
    "average_precision", "validation_f05", "training_crops", "scored_crops", "parameters", "epochs",
    "loss",
    "lowest_weight", "lowest_shape",
)  # fmt: skip

LOWEST = ("lowest_weight", "lowest_shape")


def run_study(
    crop_manifests: Sequence[str | Path],
    study: StudySettings,
    model: ModelSettings,
    voxels: VoxelSettings,
    split: SplitSettings,
    out: str | Path,
    out_times: str | Path,
    crops: int | None = None,
) -> pd.DataFrame:
    """Train and score every variant from every seed, and write a row for each.

    tau is chosen on the validation crops after the ``applied`` changes, as for the scores. Variants
    that differ only in ``applied`` changes share their trainings. A training that diverges counts
    as a dead model: its row has no loss. Nor has one of no epochs, which is an initial model.

    Args:
        crop_manifests: of the crop stores.
        study: the variants and seeds.
        model, voxels, split: the settings that the variants change.
        out: CSV file, columns ``COLUMNS``; ``lowest_weight`` and ``lowest_shape`` are the lowest
            mixing weight and shape parameter of a SCENE-Net after training.
        out_times: CSV file, columns variant, seed, training_seconds (s) and inference_ms.
        crops: most crops of a part to train on, to choose tau on and to score, evenly from those
            of the split; None for all.

    Returns:
        the table of scores.

    Raises:
        InputError: there are too few crops, or a variant cannot be trained.
    """
    data = _Crops(crop_manifests, crops)
    trained: dict[Any, tuple[VoxelModel | None, dict[str, Any]]] = {}
    rows = []
    plans = [(plan, seed) for plan in study.plans(model, voxels, split) for seed in study.seeds]
    for plan, seed in track(plans, f"study {study.name}: trainings"):
        parts = data.parts(plan.split)
        key = (plan.model.model_dump_json(), plan.voxels, plan.split, seed)
        if key not in trained:
            training = data.samples(plan.voxels, parts["train"])
            trained[key] = _trained(training, plan.model, seed)
        result, facts = trained[key]
        validation = data.samples(plan.applied_voxels, parts["validation"])
        scored = data.samples(plan.applied_voxels, parts[study.part])
        row = {"variant": plan.name, "seed": seed, **facts, "scored_crops": len(scored)}
        if result is None:
            rows.append(row | _nothing_found(scored))
        else:
            rows.append(row | _scores(_applied(result, plan), plan, validation, scored))
    return write_runs(rows, COLUMNS, ("variant", "seed"), out, out_times)


class _Crops:
    """The crops on the grids and in the parts that the variants need."""

    def __init__(self, manifests: Sequence[str | Path], most: int | None) -> None:
        """The crops of these manifests, at most ``most`` of a part; all for None."""
        self._manifests = list(manifests)
        self._most = most
        self._clouds = CropClouds(manifests)
        self._samples: dict[tuple[VoxelSettings, str], VoxelSample] = {}
        self._parts: dict[SplitSettings, dict[str, Sequence[str]]] = {}

    def parts(self, settings: SplitSettings) -> dict[str, Sequence[str]]:
        """Ids of the crops of each part."""
        if settings not in self._parts:
            table = split_crops(self._manifests, settings)
            groups = table.groupby("part")["crop"].apply(list).to_dict()
            self._parts[settings] = {
                str(part): _evenly(crops, self._most) for part, crops in groups.items()
            }
        return self._parts[settings]

    def samples(self, grid: VoxelSettings, ids: Sequence[str]) -> list[VoxelSample]:
        """The crops ``ids`` on ``grid``, voxelised from their points when they are first needed."""
        return [self._sample(grid, crop) for crop in ids]

    def _sample(self, grid: VoxelSettings, crop: str) -> VoxelSample:
        if (grid, crop) not in self._samples:
            cloud = self._clouds[crop]
            self._samples[grid, crop] = voxelise(cloud, grid.grid(cloud.xyz), crop)
        return self._samples[grid, crop]


def _evenly(ids: Sequence[str], most: int | None) -> Sequence[str]:
    """At most ``most`` of ``ids``, as far apart as can be; all of them for None."""
    if most is None or len(ids) <= most:
        return ids
    return [ids[i * len(ids) // most] for i in range(most)]


def _trained(
    training: Sequence[VoxelSample], settings: ModelSettings, seed: int
) -> tuple[VoxelModel | None, dict[str, Any]]:
    """The model (None if its training diverged), and columns about the training."""
    begin = time.perf_counter()
    try:
        model, history = fit(training, [], settings, seed, with_evidence=False)
        loss = float(history["loss"].iloc[-1]) if len(history) else math.nan
        found = {"epochs": len(history), "loss": loss, **_lowest(model)}
    except LostTraining as error:
        print(error, file=sys.stderr)
        model, found = None, dict.fromkeys(("epochs", "loss", *LOWEST), math.nan)
    return model, {
        "kind": settings.kind,
        "training_crops": len(training),
        "parameters": (model or new_model(settings, seed)).n_parameters(),
        "training_seconds": time.perf_counter() - begin,
        **found,
    }


def _lowest(model: VoxelModel) -> dict[str, float]:
    """The lowest parameters; negative ones break the convexity that the loss enforces (thesis 4.5,
    5.3.3)."""
    if not isinstance(model, GeneoModel):
        return dict.fromkeys(LOWEST, math.nan)
    numbers = model.shape_parameters()
    mixing = [value for name, value in numbers.items() if name.startswith("lambda.")]
    shapes = [value for name, value in numbers.items() if not name.startswith("lambda.")]
    return dict(zip(LOWEST, (min(mixing), min(shapes)), strict=True))


def _applied(model: VoxelModel, plan: Plan) -> VoxelModel:
    if plan.applied_size is None:
        return model
    try:
        return model.with_kernel_size(plan.applied_size)
    except InputError as error:
        raise InputError(f"{plan.name}: {error.problem}", remedy=error.remedy) from None


def _nothing_found(scored: Sequence[VoxelSample]) -> dict[str, Any]:
    n_tower = sum(int(sample.labelled.sum()) for sample in scored)
    n_voxels = sum(sample.grid.n_voxels for sample in scored)
    unknown = dict.fromkeys(("tau", "inference_ms"), math.nan)
    zero = {"average_precision": 0.0, "validation_f05": 0.0, "alive": False}
    return Confusion(fn=n_tower, tn=n_voxels - n_tower).scores() | unknown | zero


def _scores(
    model: VoxelModel,
    plan: Plan,
    validation: Sequence[VoxelSample],
    scored: Sequence[VoxelSample],
) -> dict[str, Any]:
    measurement = plan.model.measurement
    tau, chosen = threshold_curve(model, validation, measurement).best()
    curve: ThresholdCurve = threshold_curve(model, scored, measurement)
    counts = curve.at(tau)
    inference = milliseconds(
        lambda sample: probabilities(model, sample, measurement), scored[:CROPS]
    )
    return counts.scores() | {
        "alive": counts.tp > 0,
        "tau": tau,
        "average_precision": curve.average_precision(),
        "validation_f05": chosen.f05,
        "inference_ms": inference,
    }
