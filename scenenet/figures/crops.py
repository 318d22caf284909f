"""Figures of predictions: single test crops and classified surveys (thesis Figures 5.8 and 5.9).

Every function that draws writes one PNG and returns (alternative text, caption).
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scenenet.core.errors import InputError
from scenenet.figures.selection import (
    POINTS_PER_PICTURE,
    champion_of,
    crop_cloud,
    ranked,
    thinned,
)
from scenenet.metrics.score_columns import score_text
from scenenet.results.folder import Results
from scenenet.results.seed_result import SeedResult

if TYPE_CHECKING:
    from scenenet.evaluation.result import SampleScores
    from scenenet.figures.plots.point_clouds import View
    from scenenet.pointcloud import PointCloud

FINER = (64, 128)
"""Voxels per edge: the training grid of the thesis, and the finer grid of its predictions."""


def draw_crop(results: Results, reference: str, rank: str, out: Path) -> tuple[str, str]:
    from scenenet.figures.plots.point_clouds import View, side_views

    chosen_by = champion_of(results, reference)
    sample = ranked(chosen_by, rank)
    cloud = crop_cloud(results, sample.id)
    views = [View("labels", cloud.roles, "class")]
    views += [_probability(cloud, champion_of(results, model)) for model in results.models]
    keep = thinned(len(cloud))
    shown = [replace(view, values=view.values[keep]) for view in views]
    return side_views(cloud.xyz[keep], shown, out), (
        f"Crop {sample.id}: the {rank} of {len(chosen_by.evaluation.per_sample)} test crops "
        f"by F0.5 of {reference} against the labels (F0.5 {score_text(sample.f05)}, precision "
        f"{score_text(sample.precision)}, recall {score_text(sample.recall)}"
        f"{_counted(chosen_by, sample)}). Points have the probability of their voxel; each model "
        "is its best seed on validation. Compare thesis Figures 5.8 and 5.9."
    )


def _counted(result: SeedResult, sample: SampleScores) -> str:
    """Which voxels the scores of a sample count, unless those at or above tau."""
    if not result.evaluation.whole_towers:
        return ""
    return f"; whole towers. F0.5 of the voxels at or above tau: {score_text(sample.f05_observer)}"


def draw_prediction(results: Results, survey: str, out: Path) -> tuple[str, str]:
    from scenenet.figures.plots.point_clouds import survey_overview

    found = results.prediction(survey)
    if found is None:
        raise InputError("the survey was not classified", file=results.folder / "predict" / survey)
    towers = [(tower.x, tower.y, tower.base) for tower in found.towers]
    xyz, probability = _classified_points(results.folder / "predict" / survey / f"{survey}.laz")
    alt = survey_overview(xyz, probability, np.asarray(towers, float).reshape(-1, 3), out)
    return alt, (
        f"{survey} from above and from the side, along its main direction. Colour is the tower "
        "probability of each point (all points with a probability of at least 0.5 are drawn, the "
        "others are thinned). Red marks: detected towers, numbered as in the list."
    )


def draw_resolutions(results: Results, model: str, out: Path) -> tuple[str, str]:
    """The median test crop on the training grid and on a grid of twice its resolution."""
    from scenenet.dataset.voxels import VoxelGrid, voxelise
    from scenenet.figures.plots.grids import GridView, labels_and_predictions
    from scenenet.metrics.voxel_scores import confusion
    from scenenet.models.model_file import read_model
    from scenenet.models.predictions import probabilities

    champion = champion_of(results, model)
    sample = ranked(champion, "median")
    cloud = crop_cloud(results, sample.id)
    trained, card = read_model(champion.model_files[0])
    views, scores = [], []
    for resolution in FINER:
        voxels = voxelise(cloud, VoxelGrid.cube(cloud.xyz, resolution), sample.id)
        probability, truth = probabilities(trained, voxels, card.measurement)
        counts = confusion(probability, truth, card.threshold())
        size = voxels.grid.voxel_size
        title = f"{resolution}³, voxels of {size:.2f} m"
        centres = voxels.grid.centres(voxels.index)
        views.append(GridView(title, centres, size, voxels.labelled, probability[voxels.index]))
        scores.append(
            f"precision {score_text(counts.precision)} and recall {score_text(counts.recall)} "
            f"at {resolution}³"
        )
    trained_on = {
        "m": "in metres",
        "voxel": "in voxels, with the same number of voxels on both grids",
    }[trained.units]
    return labels_and_predictions(views, card.threshold(), out), (
        f"Crop {sample.id}, the median test crop by F0.5 of {model}, on two grids. From the "
        f"left: voxels labelled tower; probability of {model} (seed {champion.seed}); voxels at "
        f"or above tau (green: true positive, orange: false positive, pink: false negative). The "
        f"model was trained on voxels of {card.voxel_size:.2f} m only; its kernels are "
        f"{trained_on}. At the same tau of {card.threshold():.3f} it has {' and '.join(scores)}. "
        f"Compare thesis Figure 5.10."
    )


def _probability(cloud: PointCloud, champion: SeedResult) -> View:
    """The probabilities of a model for a crop, on the grid of its training."""
    from scenenet.dataset.voxels import VoxelSettings, voxelise
    from scenenet.figures.plots.point_clouds import View
    from scenenet.models.model_file import read_model
    from scenenet.models.predictions import probabilities

    model, card = read_model(champion.model_files[0])
    settings = VoxelSettings(fit=card.fit, resolution=card.resolution, voxel_size=card.voxel_size)
    grid = settings.grid(cloud.xyz)
    probability, _ = probabilities(model, voxelise(cloud, grid), card.measurement)
    return View(champion.model, probability[grid.voxel_of(cloud.xyz)], "probability")


def _classified_points(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """(N, 3) m and (N,) probability of a classified survey, thinned for drawing."""
    import laspy

    positions, probabilities = [], []
    with laspy.open(path) as reader:
        step = max(1, reader.header.point_count // POINTS_PER_PICTURE)
        for chunk in reader.chunk_iterator(1_000_000):
            probability = np.asarray(chunk["tower_probability"], float)
            keep = probability >= 0.5
            keep[::step] = True
            positions.append(np.stack([chunk.x, chunk.y, chunk.z], axis=1)[keep])
            probabilities.append(probability[keep])
    return np.concatenate(positions), np.concatenate(probabilities)
