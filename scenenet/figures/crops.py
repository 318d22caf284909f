"""Pictures of answers: single test crops and classified surveys (thesis Figures 5.8 and 5.9).

Every function that draws writes one PNG and returns (alternative text, caption).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scenenet.core.errors import InputError
from scenenet.figures.selection import (
    POINTS_PER_PICTURE,
    champion_of,
    crop_cloud,
    ranked,
    thinned,
)
from scenenet.results.folder import Results, SeedResult

if TYPE_CHECKING:
    from scenenet.figures.plots.point_clouds import View
    from scenenet.pointcloud import PointCloud

FINER = (64, 128)
"""Voxels an edge: the thesis' grid of training, and the one it is answered on after."""


def draw_crop(results: Results, reference: str, rank: str, out: Path) -> tuple[str, str]:
    from scenenet.figures.plots.point_clouds import View, side_views

    chosen_by = champion_of(results, reference)
    sample = ranked(chosen_by, rank)
    cloud = crop_cloud(results, sample)
    views = [View("labels", cloud.roles, "class")]
    views += [_probability(cloud, champion_of(results, model)) for model in results.models]
    keep = thinned(len(cloud))
    shown = [replace(view, values=view.values[keep]) for view in views]
    return side_views(cloud.xyz[keep], shown, out), (
        f"Crop {sample['id']}: the {rank} of {len(chosen_by.evaluation['per_sample'])} test crops "
        f"by F0.5 of {reference} (here {sample['f05']:.2f}, precision {sample['precision']:.2f}, "
        f"recall {sample['recall']:.2f}{_counted(chosen_by, sample)}). Points take the probability "
        "of their voxel; each model is the seed that is best on validation. As thesis Figures 5.8 "
        "and 5.9."
    )


def _counted(result: SeedResult, sample: Mapping[str, Any]) -> str:
    """What the scores of a sample count, where it is not what reaches tau."""
    if not result.evaluation["whole_towers"]:
        return ""
    return f", whole towers; of the voxels that reach tau F0.5 is {sample['f05_observer']:.2f}"


def draw_prediction(results: Results, survey: str, out: Path) -> tuple[str, str]:
    from scenenet.figures.plots.point_clouds import survey_overview

    found = results.prediction(survey)
    if found is None:
        raise InputError("was not predicted", file=results.folder / "predict" / survey)
    _, geojson = found
    towers = [
        (*feature["geometry"]["coordinates"][:2], feature["properties"]["base_elevation"])
        for feature in geojson["features"]
    ]
    xyz, probability = _classified_points(results.folder / "predict" / survey / f"{survey}.laz")
    alt = survey_overview(xyz, probability, np.asarray(towers, float).reshape(-1, 3), out)
    return alt, (
        f"{survey} from above and from the side, along its main direction. Colour is the tower "
        "probability of each point (every point that is likely a tower is drawn, the others are "
        "thinned); red marks are the detected towers, numbered as in the list."
    )


def draw_resolutions(results: Results, model: str, out: Path) -> tuple[str, str]:
    """The middle test crop at the grid of training and at one of twice its resolution."""
    from scenenet.dataset.voxels import VoxelGrid, voxelise
    from scenenet.figures.plots.grids import GridView, truth_and_answer
    from scenenet.metrics.voxel_scores import confusion
    from scenenet.models.model_file import read_model
    from scenenet.models.predictions import probabilities

    champion = champion_of(results, model)
    sample = ranked(champion, "median")
    cloud = crop_cloud(results, sample)
    trained, card = read_model(champion.model_files[0])
    views, said = [], []
    for resolution in FINER:
        voxels = voxelise(cloud, VoxelGrid.cube(cloud.xyz, resolution), sample["id"])
        probability, truth = probabilities(trained, voxels, card.measurement)
        counts = confusion(probability, truth, card.threshold())
        size = voxels.grid.voxel_size
        title = f"{resolution}³, voxels of {size:.2f} m"
        centres = voxels.grid.centres(voxels.index)
        views.append(GridView(title, centres, size, voxels.tower, probability[voxels.index]))
        said.append(
            f"at {resolution}³ precision {counts.precision:.2f} and recall {counts.recall:.2f}"
        )
    trained_on = {"m": "in metres", "voxel": "in voxels, as many on both grids"}[trained.units]
    return truth_and_answer(views, card.threshold(), out), (
        f"Crop {sample['id']}, the middle one of the test crops by F0.5 of {model}, on two grids: "
        f"what is labelled tower, what {model} (seed {champion.seed}) answers, and where that is "
        "right at its tau: green is right, orange is no tower, pink was missed. It was trained "
        f"on voxels of {card.voxel_size:.2f} m alone; its kernels are {trained_on}. At the same "
        f"tau of {card.threshold():.3f} it has {' and '.join(said)} of the voxels that reach tau. "
        "As thesis Figure 5.10."
    )


def _probability(cloud: PointCloud, champion: SeedResult) -> View:
    """The answer of a model to a crop, on the grid it was trained on."""
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
