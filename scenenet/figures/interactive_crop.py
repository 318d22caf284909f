"""A test crop as voxels for the 3D view of the report (thesis Figures 5.6, 5.8, 5.9).

The view shows class, probability, contributions, and the scores at every threshold.
"""

from __future__ import annotations

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
from scenenet.results.interactive_crop import InteractiveCrop, WholeTowerScores

if TYPE_CHECKING:
    from scenenet.dataset.voxels import VoxelSample
    from scenenet.detection.settings import DetectionSettings
    from scenenet.models.base import VoxelModel

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


def write_interactive_crop(
    results: Results,
    model: str,
    rank: str,
    out: str | Path,
    detection: DetectionSettings | None = None,
) -> InteractiveCrop:
    """Write the best, median or worst test crop of a model for the report.

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
    from scenenet.evaluation.scoring import answer_of
    from scenenet.figures.selection import champion_of, crop_cloud, ranked, voxel_classes
    from scenenet.metrics.threshold_curve import THRESHOLDS, ThresholdCurve
    from scenenet.models.model_file import read_model
    from scenenet.models.predictions import probabilities

    champion = champion_of(results, model)
    sample = ranked(champion, rank)
    cloud = crop_cloud(results, sample.id)
    trained, card = read_model(champion.model_files[0])
    settings = VoxelSettings(fit=card.fit, resolution=card.resolution, voxel_size=card.voxel_size)
    voxels = voxelise(cloud, settings.grid(cloud.xyz), sample.id)
    names = voxel_classes(cloud.roles, voxels.grid.voxel_of(cloud.xyz), voxels.index)
    probability, truth = probabilities(trained, voxels, card.measurement)
    tau = card.threshold()
    answer = answer_of(trained, card, {sample.id: cloud}, detection or DetectionSettings())
    whole = answer(voxels).among(len(truth))
    curve = ThresholdCurve.of(probability, truth)
    taus = THRESHOLDS.astype(probability.dtype)
    made = InteractiveCrop(
        crop=sample.id,
        rank=rank,
        model=model,
        seed=champion.seed,
        voxel_size=voxels.grid.voxel_size,
        classes=CLASSES,
        zyx=np.stack(np.unravel_index(voxels.index, voxels.grid.shape), axis=1),
        voxel_class=np.array([CLASSES.index(name) for name in names], np.uint8),
        tower=voxels.labelled,
        shares=_shares(trained, voxels, card.measurement),
        steps=np.searchsorted(taus, probability[voxels.index], side="right"),
        taus=tuple(float(f"{tau:.6g}") for tau in THRESHOLDS),
        true=tuple(curve.true.tolist()),
        false=tuple(curve.false.tolist()),
        tau_step=int(np.argmin(np.abs(THRESHOLDS - tau))),
        whole=whole[voxels.index],
        whole_scores=_scores(whole, truth),
    )
    write_json(out, made.to_json())
    return made


def _scores(whole: np.ndarray, truth: np.ndarray) -> WholeTowerScores:
    """Of (V,) voxels of whole towers among all voxels of the grid."""
    from scenenet.metrics.voxel_scores import Confusion

    scores = Confusion.of(whole, truth).scores()
    return WholeTowerScores(scores["precision"], scores["recall"], scores["f05"])


def _shares(model: VoxelModel, voxels: VoxelSample, measurement: str) -> dict[str, np.ndarray]:
    """The share of each GENEO in the output of each occupied voxel, (M,) %; empty for a CNN."""
    import torch

    from scenenet.convolution.coarsening import coarsened
    from scenenet.dataset.batches import batch
    from scenenet.models.geneo_model import GeneoModel

    if not isinstance(model, GeneoModel):
        return {}
    size = voxels.grid.voxel_size
    model = model.at(model.observed_size(size))
    observed, block = coarsened(batch([voxels], measurement)[0], model.block_edge(size))
    with torch.no_grad():
        parts = model.responder()(observed).numpy()[:, block]
    whole = np.maximum(np.abs(parts).sum(axis=0), np.finfo(parts.dtype).tiny)
    percent = np.rint(100 * parts / whole).astype(np.int8)
    return dict(zip(model.names, percent, strict=True))
