"""From voxels that look like a tower to towers (thesis 5.1.2, last paragraph)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydantic import Field

from scenenet.settings import Settings


class DetectionSettings(Settings):
    """What makes a tower of detected voxels."""

    eps: float = Field(
        6.0, gt=0, description="m, planar; detected voxels nearer than this are one tower"
    )
    min_voxels: int = Field(5, ge=1, description="detected voxels that a tower must have")
    min_height: float = Field(
        9.0, ge=0, description="m; thesis 5.1.2 has towers from 18 m, wooden poles begin at 9 m"
    )
    min_body: float = Field(
        6.0,
        ge=0,
        description="m from the lowest to the highest detected voxel: a tower is detected along "
        "its body, a treetop or a roof at one place",
    )
    foot_radius: float = Field(
        5.0, gt=0, description="m, around the tower, where the ground at its foot is looked for"
    )


@dataclass(frozen=True)
class DetectedTower:
    """A tower found in a prediction.

    Attributes:
        x, y: m, mean of its detected voxels, each weighted by its probability.
        base: m, elevation of the ground at its foot.
        height: m, from there to the top of its highest detected voxel.
        probability: highest probability among its voxels.
        voxels: positions of its voxels in what was passed to ``detect_towers``.
    """

    x: float
    y: float
    base: float
    height: float
    probability: float
    voxels: np.ndarray


def detect_towers(
    centres: np.ndarray,
    probability: np.ndarray,
    surroundings: np.ndarray,
    voxel_size: float,
    settings: DetectionSettings,
) -> list[DetectedTower]:
    """Group detected voxels into towers, highest probability first.

    Args:
        centres: (V, 3) m, middles of the voxels with probability >= tau.
        probability: (V,).
        surroundings: (M, 3) m, middles of occupied voxels, at least all within ``foot_radius`` of
            a detected one.
        voxel_size: m.
    """
    if len(centres) == 0:
        return []
    from scipy.spatial import cKDTree
    from sklearn.cluster import DBSCAN

    offset = centres.min(axis=0)
    # In plan: what stands above one another is one tower, however little lies between. One place a
    # column, because DBSCAN's memory grows with the pairs of places that are near each other.
    columns, column_of = np.unique((centres - offset)[:, :2], axis=0, return_inverse=True)
    labels = DBSCAN(eps=settings.eps, min_samples=1).fit_predict(columns)[column_of.reshape(-1)]
    ground = cKDTree(surroundings[:, :2] - offset[:2])
    towers = []
    for label in range(labels.max() + 1):
        voxels = np.flatnonzero(labels == label)
        body = float(np.ptp(centres[voxels, 2])) + voxel_size
        if len(voxels) < settings.min_voxels or body < settings.min_body:
            continue
        x, y = np.average(centres[voxels, :2], axis=0, weights=probability[voxels])
        near = ground.query_ball_point([x - offset[0], y - offset[1]], settings.foot_radius)
        elevations = np.append(surroundings[near, 2], centres[voxels, 2].min())
        # Not the lowest: a return from below the ground must not make a tower of a bush.
        base = float(np.percentile(elevations, 5)) - voxel_size / 2
        height = float(centres[voxels, 2].max()) + voxel_size / 2 - base
        if height < settings.min_height:
            continue
        peak = float(probability[voxels].max())
        towers.append(DetectedTower(float(x), float(y), base, height, peak, voxels))
    return sorted(towers, key=lambda t: (-t.probability, t.x, t.y))
