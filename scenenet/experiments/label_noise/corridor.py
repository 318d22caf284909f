"""Crops of a synthetic line with a known share of wrong labels, and with the truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scenenet.core.errors import InputError
from scenenet.dataset.voxels import VoxelSample, VoxelSettings, voxelise
from scenenet.pointcloud.class_schemes import EDP
from scenenet.pointcloud.cloud import PointCloud
from scenenet.synthetic import SyntheticSettings, make_corridor
from scenenet.synthetic.codes import TOWER
from scenenet.synthetic.corridor import Corridor

STRENGTHS = tuple(np.linspace(0, 1, 26).round(2).tolist())
"""Strengths of the annotation noise; the strength for a level is interpolated between them."""


@dataclass(frozen=True)
class NoisyLine:
    """The crops of a line with label noise, in the order of its towers.

    Attributes:
        level: requested share of mislabelled tower points.
        strength: the ``annotation_noise`` that comes nearest to it.
        share: actual share: mislabelled points among all points labelled tower.
        labelled: the crops with the noisy labels.
        true: the same voxels with the true classes.
    """

    level: float
    strength: float
    share: float
    labelled: list[VoxelSample]
    true: list[VoxelSample]


def noisy_lines(
    settings: SyntheticSettings, levels: Sequence[float], grid: VoxelSettings
) -> list[NoisyLine]:
    """One line at every level of noise; points and voxels are the same at every level.

    A crop is every point within one tower height (planar) of a tower (thesis 5.1.3). Crops are cut
    around the true towers, so that they do not depend on the labels.

    Raises:
        InputError: no strength of the annotation noise reaches a level.
    """
    corridor = make_corridor(settings)
    strengths = _strengths(corridor, levels)
    stretches = [corridor.stretch_at(index, strengths) for index in range(len(corridor))]
    xyz = np.concatenate([at[0].xyz for at in stretches])
    truth = np.concatenate([at[0].truth for at in stretches])
    inside = [
        np.flatnonzero(np.hypot(*(xyz[:, :2] - (tower.x, tower.y)).T) <= tower.height)
        for tower in corridor.towers
    ]
    names = [f"tower-{tower.id:03d}" for tower in corridor.towers]

    def crops(codes: np.ndarray) -> list[VoxelSample]:
        clouds = [PointCloud(xyz[points], codes[points], EDP) for points in inside]
        return [
            voxelise(cloud, grid.grid(cloud.xyz), name)
            for cloud, name in zip(clouds, names, strict=True)
        ]

    true = crops(truth)
    lines = []
    for number, (level, strength) in enumerate(zip(levels, strengths, strict=True)):
        labels = np.concatenate([at[number].labels for at in stretches])
        share = _wrong_share(*_tower_counts(labels, truth))
        lines.append(NoisyLine(level, strength, share, crops(labels), true))
    return lines


def _strengths(corridor: Corridor, levels: Sequence[float]) -> list[float]:
    """The strength of the annotation noise that reaches each level on this line."""
    counts = np.zeros((len(STRENGTHS), 2))
    for index in range(len(corridor)):
        made = corridor.stretch_at(index, STRENGTHS)
        counts += [_tower_counts(stretch.labels, stretch.truth) for stretch in made]
    # Draws differ a little between strengths: by chance, a higher one may mislabel fewer points.
    shares = np.maximum.accumulate([_wrong_share(*both) for both in counts])
    if max(levels, default=0) > shares[-1]:
        raise InputError(
            f"no annotation noise mislabels {max(levels):.0%} of the tower points of this line; "
            f"the "
            f"strongest mislabels {shares[-1]:.0%}",
            remedy="Set label_noise.levels lower",
        )
    return [float(np.interp(level, shares, STRENGTHS)) if level else 0.0 for level in levels]


def _tower_counts(labels: np.ndarray, truth: np.ndarray) -> tuple[int, int]:
    """Numbers of points labelled tower, and of those among them that are not tower."""
    tower = labels == TOWER
    return int(tower.sum()), int((tower & (truth != TOWER)).sum())


def _wrong_share(labelled: float, wrong: float) -> float:
    return float(wrong / max(labelled, 1))
