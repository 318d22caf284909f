"""The selection of what figures show: the best seed, a crop, a subset of points.

Crops are selected by rule (best, median, worst), never by hand.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from scenenet.core.errors import InputError
from scenenet.pointcloud.class_schemes import ROLE_COLOURS
from scenenet.results.folder import Results
from scenenet.results.result_files import read_table
from scenenet.results.seed_result import SeedResult

if TYPE_CHECKING:
    from scenenet.evaluation.result import SampleScores
    from scenenet.pointcloud import PointCloud

CLASSES = tuple(ROLE_COLOURS)
"""Roles of points, the most important first."""

POINTS_PER_PICTURE = 60_000
"""Enough points to look dense at the size of the figures."""


def champion_of(results: Results, model: str) -> SeedResult:
    """The seed that is best on validation.

    Raises:
        InputError: the model has not been tuned.
    """
    champion = results.champion(model)
    if champion is None or not champion.model_files:
        raise InputError(f"no tuned model called {model}", file=results.folder / "models" / model)
    return champion


def ranked(champion: SeedResult, rank: str) -> SampleScores:
    """The best, median or worst test crop by F0.5, of those that have one; ties by name."""
    scored = [(crop.f05, crop) for crop in champion.evaluation.per_sample if crop.f05 is not None]
    ordered = [crop for _, crop in sorted(scored, key=lambda pair: (-pair[0], pair[1].id))]
    if not ordered:
        raise InputError(f"{champion.model} seed {champion.seed} has no evaluated crop")
    return {"best": ordered[0], "median": ordered[len(ordered) // 2], "worst": ordered[-1]}[rank]


def crop_cloud(results: Results, crop: str) -> PointCloud:
    """The points of the test crop with that id."""
    from scenenet.dataset.crops import CropClouds

    split = read_table(results.folder / "split" / "split.csv").astype({"crop": str})
    survey = split.loc[split["crop"] == crop, "survey"].iloc[0]
    return CropClouds([results.folder / "crops" / survey / "manifest.json"])[crop]


def voxel_classes(groups: np.ndarray, voxel: np.ndarray, index: np.ndarray) -> np.ndarray:
    """(M,) class of each occupied voxel: the first of ``CLASSES`` that any of its points has.

    Args:
        groups: (N,) of ``ClassScheme.roles``.
        voxel: (N,) flat voxel of each point.
        index: (M,) flat occupied voxels, ascending.
    """
    codes = np.zeros(len(groups), np.uint8)
    for code, name in enumerate(reversed(CLASSES)):
        codes[groups == name] = code
    shown = np.zeros(len(index), np.uint8)
    np.maximum.at(shown, np.searchsorted(index, voxel), codes)
    return np.array(CLASSES)[::-1][shown]


def thinned(n: int, most: int = POINTS_PER_PICTURE) -> np.ndarray:
    """Evenly spread positions of at most ``most`` of ``n`` points."""
    return np.arange(0, n, max(1, -(-n // most)))
