"""Answers for a crop: which points and voxels are tower, and where towers stand.

With the rules of tower detection the answer is the one that ``scenenet predict`` gives for the
crop, for any source of probabilities: a model, boosted trees, or a constant.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scenenet.dataset.voxels import VoxelGrid, VoxelSample, voxelise
from scenenet.detection.detected_voxels import DetectedVoxels
from scenenet.detection.find import find_towers
from scenenet.detection.measured_tower import MeasuredTower
from scenenet.detection.settings import DetectionSettings
from scenenet.detection.surroundings import surroundings_in
from scenenet.detection.survey_tower import SurveyTower
from scenenet.evaluation.points import PointCounts
from scenenet.measurement.registry import PRESENCE
from scenenet.metrics.tower_matching import TowerMatch, match_towers
from scenenet.pointcloud.cloud import PointCloud
from scenenet.pointcloud.targets import Target

Predict = Callable[[VoxelSample], tuple[np.ndarray, np.ndarray]]
"""Sample -> probabilities (V,) and labels (V,) bool of all voxels of its grid."""


@dataclass(frozen=True)
class Answer:
    """What is tower in a crop.

    Attributes:
        points: counts of its points that are in a tower.
        voxels: (K,) flat indices, ascending, of the voxels of its grid that are tower.
        towers: (T, 4) m: x, y, elevation of the base and height of each tower, the last two NaN
            where they were not measured; None where no towers were looked for.
    """

    points: PointCounts
    voxels: np.ndarray
    towers: np.ndarray | None

    @classmethod
    def of_points(
        cls,
        cloud: PointCloud,
        grid: VoxelGrid,
        in_tower: np.ndarray,
        towers: np.ndarray | None = None,
    ) -> Answer:
        """The answer with some points ``in_tower`` (N,) bool. A voxel with one of them is tower, as
        a voxel with a labelled point is labelled."""
        voxels = np.unique(grid.voxel_of(cloud.xyz[in_tower]))
        return cls(PointCounts.of(cloud, in_tower), voxels, towers)

    def among(self, n_voxels: int) -> np.ndarray:
        """(V,) bool, which of all ``n_voxels`` voxels of the grid are tower."""
        mask = np.zeros(n_voxels, bool)
        mask[self.voxels] = True
        return mask

    def match(self, true: np.ndarray) -> TowerMatch | None:
        """Match its towers with the labelled or true ones (T, 4), as ``dataset.crops.Crop`` has
        them; None where no towers were looked for."""
        return None if self.towers is None else match_towers(self.towers, true)


Answering = Callable[[VoxelSample], Answer | None]
"""A crop on the grid of the data set -> what is tower in it; None where whole towers are not looked
for."""


def at_or_above_tau(cloud: PointCloud, sample: VoxelSample, predict: Predict, tau: float) -> Answer:
    """The answer without rules: the voxels that reach tau, the points in them, and a tower for each
    group of voxels that touch."""
    probability, _ = predict(sample)
    voxels, grid = probability >= tau, sample.grid
    towers = group_places(voxels.reshape(grid.shape), grid)
    points = PointCounts.of(cloud, voxels[grid.voxel_of(cloud.xyz)])
    return Answer(points, np.flatnonzero(voxels), towers)


def group_places(voxels: np.ndarray, grid: VoxelGrid) -> np.ndarray:
    """(T, 4) m, the mean position of each group of voxels (D, H, W) bool that touch at a face, an
    edge or a corner, as in ``Answer.towers``; base and height are NaN."""
    from scipy import ndimage

    groups, n = ndimage.label(voxels, structure=np.ones((3, 3, 3)))
    if n == 0:
        return np.empty((0, 4))
    zyx = np.array(ndimage.center_of_mass(voxels, groups, np.arange(1, n + 1)))
    xy = np.asarray(grid.origin[:2]) + (zyx[:, :0:-1] + 0.5) * grid.voxel_size
    return np.column_stack([xy, np.full((n, 2), np.nan)])


def with_rules(
    cloud: PointCloud,
    sample: VoxelSample,
    predict: Predict,
    tau: float,
    voxel_size: float,
    detection: DetectionSettings,
    measurement: str = PRESENCE,
) -> Answer:
    """The answer of ``scenenet predict`` for a crop as a survey of its own.

    Args:
        cloud, sample: the points of the crop, and its voxels on the grid of the data set.
        voxel_size: m, of the voxels in which the survey is predicted.
        measurement: phi that ``predict`` asks for.
    """
    seen = voxelise(
        cloud, VoxelGrid.on_map(cloud.xyz, voxel_size), sample.id, measurement=measurement
    )
    probability, _ = predict(seen)
    of_occupied = probability[seen.index]
    detected = of_occupied >= detection.threshold(tau)
    centres = seen.grid.centres(seen.index)
    towers = find_towers(
        DetectedVoxels(centres[detected], of_occupied[detected], voxel_size),
        surroundings_in(centres),
        surroundings_in(cloud.xyz),
        tau,
        detection,
    )
    own = _own_points(cloud.xyz, towers)
    return Answer.of_points(cloud, sample.grid, own, places_of(towers))


def rules_on(
    clouds: Mapping[str, PointCloud],
    predict: Predict,
    tau: float,
    voxel_size: float,
    detection: DetectionSettings,
    measurement: str = PRESENCE,
) -> Callable[[VoxelSample], Answer]:
    """The answer ``with_rules`` for each crop whose points are in ``clouds`` by its id."""
    how = predict, tau, voxel_size, detection, measurement
    return lambda sample: with_rules(clouds[sample.id], sample, *how)


def points_on(
    clouds: Mapping[str, PointCloud], predict: Predict, tau: float, target: Target
) -> Callable[[VoxelSample], Answer]:
    """The answer for another target than towers in each crop whose points are in ``clouds`` by its
    id: the voxels that reach tau, and the points in them."""

    def answer(sample: VoxelSample) -> Answer:
        probability, _ = predict(sample)
        voxels, cloud = probability >= tau, clouds[sample.id]
        points = PointCounts.of(cloud, voxels[sample.grid.voxel_of(cloud.xyz)], target)
        return Answer(points, np.flatnonzero(voxels), None)

    return answer


def no_answer(sample: VoxelSample) -> None:
    """Whole towers are not looked for."""


def places_of(towers: Sequence[MeasuredTower | SurveyTower]) -> np.ndarray:
    """(T, 4) m: x, y, elevation of the base, and height of each tower."""
    places = [[tower.x, tower.y, tower.base, tower.height] for tower in towers]
    return np.array(places, float).reshape(-1, 4)


def _own_points(xyz: np.ndarray, towers: list[MeasuredTower]) -> np.ndarray:
    """(N,) bool, which points lie in the shape of a tower."""
    own = np.zeros(len(xyz), bool)
    for tower in towers:
        shape = tower.structure
        away = np.hypot(xyz[:, 0] - shape.x, xyz[:, 1] - shape.y)
        rows = np.flatnonzero(away <= shape.reach)
        own[rows[shape.contains(xyz[rows])]] = True
    return own
