"""A test crop as voxels for the 3D view of the report (thesis Figures 5.6, 5.8, 5.9).

The view shows class, probability, contributions, and the scores at every threshold.
"""

from __future__ import annotations

import base64
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scenenet.core.files import write_json
from scenenet.figures.plots.style import (
    BACKGROUND_COLOUR,
    CONTRIBUTION_COLOURS,
    OUTCOME_COLOURS,
    TOWER_COLOUR,
)
from scenenet.pointcloud.class_schemes import ROLE_COLOURS
from scenenet.results.folder import Results

if TYPE_CHECKING:
    from scenenet.dataset.voxels import Measurement, VoxelSample
    from scenenet.detection.settings import DetectionSettings
    from scenenet.models.base import VoxelModel
    from scenenet.pointcloud import PointCloud

CLASSES = tuple(reversed(tuple(ROLE_COLOURS)))
"""Class of a voxel: the last of these that any of its points has."""

PALETTE: dict[str, Any] = {
    "class": dict(ROLE_COLOURS),
    "outcome": OUTCOME_COLOURS | {"true negative": BACKGROUND_COLOUR},
    "probability": (BACKGROUND_COLOUR, TOWER_COLOUR),
    "contribution": CONTRIBUTION_COLOURS,
}
"""Colours of the 3D view: of classes and outcomes by name; of probabilities from 0 to 1; of
contributions of -100 %, 0 and 100 %."""


def write_scene(
    results: Results,
    model: str,
    rank: str,
    out: str | Path,
    detection: DetectionSettings | None = None,
) -> dict[str, Any]:
    """Write the best, median or worst test crop of a model for the report.

    Arrays are little-endian and in base64: ``zyx`` (M, 3) int16 voxels; ``class`` (M,) uint8
    indices into ``classes``; ``steps`` (M,) uint16 number of thresholds that the probability
    reaches; ``tower`` (M,) uint8 labels; for a SCENE-Net ``shares`` by GENEO, (M,) int8 per cent
    of the output. ``true`` and ``false`` are the numbers of voxels of the grid, empty ones
    included, that reach exactly i of the thresholds ``taus``, so that scores at any threshold
    follow without the grid. ``whole`` (M,) uint8 marks the voxels of whole towers found at the tau
    of the model, ``whole_scores`` are their scores over the grid.

    Args:
        model: name of the model; its seed that is best on validation is shown.
        rank: best, median or worst, by F0.5 over the test crops.
        out: JSON file.
        detection: what makes a tower; the default if None.

    Raises:
        InputError: the model has not been tuned and evaluated.
    """
    from scenenet.dataset.voxels import VoxelSettings, voxelise
    from scenenet.detection.settings import DetectionSettings
    from scenenet.figures.selection import champion_of, crop_cloud, ranked
    from scenenet.models.model_file import read_model
    from scenenet.models.predictions import probabilities

    champion = champion_of(results, model)
    sample = ranked(champion, rank)
    cloud = crop_cloud(results, sample.id)
    trained, card = read_model(champion.model_files[0])
    settings = VoxelSettings(fit=card.fit, resolution=card.resolution, voxel_size=card.voxel_size)
    voxels = voxelise(cloud, settings.grid(cloud.xyz), sample.id)
    probability, truth = probabilities(trained, voxels, card.measurement)
    tau = card.threshold()
    scene = {
        "crop": sample.id,
        "rank": rank,
        "model": model,
        "seed": champion.seed,
        "voxel_size": voxels.grid.voxel_size,
        **_voxels(voxels, cloud),
        "shares": _shares(trained, voxels, card.measurement),
        **_thresholds(voxels, probability, truth, tau),
        **_whole_towers(voxels, probability, truth, tau, detection or DetectionSettings()),
    }
    write_json(out, scene)
    return scene


def _voxels(voxels: VoxelSample, cloud: PointCloud) -> dict[str, Any]:
    """Place, class and label of each occupied voxel."""
    from scenenet.figures.selection import voxel_classes

    zyx = np.stack(np.unravel_index(voxels.index, voxels.grid.shape), axis=1)
    names = voxel_classes(cloud.roles, voxels.grid.voxel_of(cloud.xyz), voxels.index)
    return {
        "classes": CLASSES,
        "zyx": _coded(zyx.astype("<i2")),
        "class": _coded(np.array([CLASSES.index(name) for name in names], np.uint8)),
        "tower": _coded(voxels.tower.astype("<u1")),
    }


def _thresholds(
    voxels: VoxelSample, probability: np.ndarray, truth: np.ndarray, tau: float
) -> dict[str, Any]:
    """How many thresholds each occupied voxel reaches, and the counts at every threshold.

    Args:
        probability, truth: (V,) of all voxels of the grid.
        tau: the threshold that the view starts with.
    """
    from scenenet.metrics.threshold_curve import THRESHOLDS, ThresholdCurve

    curve = ThresholdCurve.of(probability, truth)
    taus = THRESHOLDS.astype(probability.dtype)
    steps = np.searchsorted(taus, probability[voxels.index], side="right")
    return {
        "steps": _coded(steps.astype("<u2")),
        "taus": [float(f"{tau:.6g}") for tau in THRESHOLDS],
        "true": curve.true.tolist(),
        "false": curve.false.tolist(),
        "tau_step": int(np.argmin(np.abs(THRESHOLDS - tau))),
    }


def _whole_towers(
    voxels: VoxelSample,
    probability: np.ndarray,
    truth: np.ndarray,
    tau: float,
    detection: DetectionSettings,
) -> dict[str, Any]:
    """The voxels of whole towers found at tau, and their scores; arguments as ``_thresholds``."""
    from scenenet.evaluation.crop_towers import detect_in_crop
    from scenenet.metrics.voxel_scores import confusion

    whole = detect_in_crop(voxels, probability, tau, detection).voxels
    counts = confusion(voxels.spread(whole)[0], truth, 0.5).scores()
    return {
        "whole": _coded(whole.astype("<u1")),
        "whole_scores": {name: counts[name] for name in ("precision", "recall", "f05")},
    }


def _shares(model: VoxelModel, voxels: VoxelSample, measurement: Measurement) -> dict[str, str]:
    """The share of each GENEO in the output of each occupied voxel, coded; empty for a CNN."""
    import torch

    from scenenet.convolution.coarsening import coarsened
    from scenenet.dataset.batches import batch
    from scenenet.models.geneo_model import GeneoModel

    if not isinstance(model, GeneoModel):
        return {}
    size = voxels.grid.voxel_size
    model = model.at(model.observed_size(size))
    observed, block = coarsened(
        batch([voxels], measurement)[0], round(model.observed_size(size) / size)
    )
    with torch.no_grad():
        parts = model.responses(observed, model.weighted_kernels()).numpy()[:, block]
    whole = np.maximum(np.abs(parts).sum(axis=0), np.finfo(parts.dtype).tiny)
    percent = np.rint(100 * parts / whole).astype("<i1")
    return {name: _coded(row) for name, row in zip(model.names, percent, strict=True)}


def _coded(array: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode("ascii")
