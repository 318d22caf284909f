"""Towers found in a crop, matched with the labelled ones."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scenenet.convolution.coarsening import block_edge, coarsened
from scenenet.convolution.occupancy import Occupancy
from scenenet.dataset.crops import Crop
from scenenet.dataset.voxels import VoxelGrid, VoxelSample
from scenenet.detection.detect import DetectedTower, among, body_voxels, detect_towers
from scenenet.detection.settings import DetectionSettings
from scenenet.metrics.tower_matching import TowerMatch, match_towers


def _match(found: Sequence[DetectedTower], crop: Crop) -> TowerMatch:
    return match_towers(np.array([[tower.x, tower.y] for tower in found]), crop.towers)


def find_in_crop(
    sample: VoxelSample, probability: np.ndarray, tau: float, detection: DetectionSettings
) -> tuple[list[DetectedTower], np.ndarray]:
    """The towers found in a crop, and which of its occupied voxels are theirs, (M,) bool.

    Args:
        probability: (V,) of every voxel of the sample's grid.
    """
    # A tower is made of points: a detected voxel that is empty has nothing to show a person.
    answers = probability[sample.index]
    size = sample.grid.voxel_size
    edge = block_edge(size)
    # Towers are measured in blocks of about a metre: finer voxels have gaps where points are few.
    blocks, block = coarsened(Occupancy.of_grids([sample.index], None, sample.grid.shape), edge)
    coarse = VoxelGrid(sample.grid.origin, size * edge, blocks.shape)
    highest = np.zeros(len(blocks.index), answers.dtype)
    np.maximum.at(highest, block, answers)
    detected = np.flatnonzero(highest >= detection.threshold(tau))
    places = coarse.centres(blocks.index)
    found = detect_towers(
        places[detected], highest[detected], among(places), coarse.voxel_size, tau, detection
    )
    centres = sample.grid.centres(sample.index)
    theirs = np.zeros(len(centres), bool)
    for tower in found:
        seen = np.zeros(len(places), bool)
        seen[detected[tower.voxels]] = True
        theirs |= seen[block] & (answers >= tau)
        theirs |= body_voxels(tower, centres, detection)
    return found, theirs


def crop_towers(
    sample: VoxelSample,
    crop: Crop,
    probability: np.ndarray,
    tau: float,
    detection: DetectionSettings,
) -> TowerMatch:
    """Towers found in a crop against the true ones; probability as in ``find_in_crop``."""
    found, _ = find_in_crop(sample, probability, tau, detection)
    return _match(found, crop)
