"""Detection of towers in a crop, and matching with the labelled or true towers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scenenet.convolution.coarsening import block_edge, coarsened
from scenenet.convolution.occupancy import Occupancy
from scenenet.dataset.voxels import VoxelGrid, VoxelSample
from scenenet.detection.detect import DetectedTower, body_voxels, detect_towers, surroundings_in
from scenenet.detection.settings import DetectionSettings
from scenenet.detection.survey_tower import SurveyTower
from scenenet.metrics.tower_matching import TowerMatch, match_towers


@dataclass(frozen=True)
class CropDetection:
    """The towers detected in a crop.

    Attributes:
        towers: highest probability first.
        voxels: (M,) bool, which occupied voxels of the crop belong to a detected tower.
    """

    towers: list[DetectedTower]
    voxels: np.ndarray


def detect_in_crop(
    sample: VoxelSample, probability: np.ndarray, tau: float, detection: DetectionSettings
) -> CropDetection:
    """Detect the towers of a crop.

    Args:
        probability: (V,) of every voxel of the sample's grid.
        tau: threshold of the model.
    """
    of_occupied = probability[sample.index]
    size = sample.grid.voxel_size
    edge = block_edge(size)
    # Towers are measured in blocks of about a metre, because fine voxels have gaps between points.
    blocks, block = coarsened(Occupancy.of_grids([sample.index], None, sample.grid.shape), edge)
    coarse = VoxelGrid(sample.grid.origin, size * edge, blocks.shape)
    highest = np.zeros(len(blocks.index), of_occupied.dtype)
    np.maximum.at(highest, block, of_occupied)
    detected = np.flatnonzero(highest >= detection.threshold(tau))
    places = coarse.centres(blocks.index)
    around = surroundings_in(places)
    towers = detect_towers(
        places[detected], highest[detected], around, coarse.voxel_size, tau, detection
    )
    centres = sample.grid.centres(sample.index)
    of_a_tower = np.zeros(len(centres), bool)
    for tower in towers:
        in_tower = np.zeros(len(places), bool)
        in_tower[detected[tower.voxels]] = True
        of_a_tower |= in_tower[block] & (of_occupied >= tau)
        of_a_tower |= body_voxels(tower, centres, detection)
    return CropDetection(towers, of_a_tower)


def match_crop(towers: Sequence[DetectedTower], true: np.ndarray) -> TowerMatch:
    """Match the detected towers of a crop with its labelled or true ones (T, 4), as in ``Crop``."""
    return match_towers(places_of(towers), true)


def places_of(towers: Sequence[DetectedTower | SurveyTower]) -> np.ndarray:
    """(P, 4) m: x, y, elevation of the base, and height of each tower."""
    places = [[tower.x, tower.y, tower.base, tower.height] for tower in towers]
    return np.array(places, float).reshape(-1, 4)
