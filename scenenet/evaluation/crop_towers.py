"""Detection of towers in a crop, and matching with the labelled ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scenenet.convolution.coarsening import block_edge, coarsened
from scenenet.convolution.occupancy import Occupancy
from scenenet.dataset.crops import Crop
from scenenet.dataset.voxels import VoxelGrid, VoxelSample
from scenenet.detection.detect import DetectedTower, among, body_voxels, detect_towers
from scenenet.detection.settings import DetectionSettings
from scenenet.metrics.tower_matching import TowerMatch, match_towers


@dataclass(frozen=True)
class CropDetection:
    """The towers detected in a crop.

    Attributes:
        towers: highest probability first.
        voxels: (M,) bool, which occupied voxels of the crop belong to one of them.
    """

    towers: list[DetectedTower]
    voxels: np.ndarray


def detect_in_crop(
    sample: VoxelSample, probability: np.ndarray, tau: float, detection: DetectionSettings
) -> CropDetection:
    """Detect the towers of a crop.

    Args:
        probability: (V,) of every voxel of the sample's grid.
    """
    # Only occupied voxels: a tower is made of points.
    of_occupied = probability[sample.index]
    size = sample.grid.voxel_size
    edge = block_edge(size)
    # Towers are measured in blocks of about a metre: finer voxels have gaps where points are few.
    blocks, block = coarsened(Occupancy.of_grids([sample.index], None, sample.grid.shape), edge)
    coarse = VoxelGrid(sample.grid.origin, size * edge, blocks.shape)
    highest = np.zeros(len(blocks.index), of_occupied.dtype)
    np.maximum.at(highest, block, of_occupied)
    detected = np.flatnonzero(highest >= detection.threshold(tau))
    places = coarse.centres(blocks.index)
    towers = detect_towers(
        places[detected], highest[detected], among(places), coarse.voxel_size, tau, detection
    )
    centres = sample.grid.centres(sample.index)
    of_a_tower = np.zeros(len(centres), bool)
    for tower in towers:
        in_tower = np.zeros(len(places), bool)
        in_tower[detected[tower.voxels]] = True
        of_a_tower |= in_tower[block] & (of_occupied >= tau)
        of_a_tower |= body_voxels(tower, centres, detection)
    return CropDetection(towers, of_a_tower)


def match_crop(towers: Sequence[DetectedTower], crop: Crop) -> TowerMatch:
    """Detected towers of a crop against its labelled ones."""
    return match_towers(np.array([[tower.x, tower.y] for tower in towers]), crop.towers)
