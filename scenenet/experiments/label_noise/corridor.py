"""Crops of a synthetic line whose labels are wrong to a known share, with the truth beside."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from scenenet.core.errors import InputError
from scenenet.dataset.voxels import VoxelSample, VoxelSettings, voxelise
from scenenet.pointcloud.class_schemes import EDP
from scenenet.pointcloud.cloud import PointCloud
from scenenet.synthetic import SyntheticSettings, make_corridor
from scenenet.synthetic.codes import TOWER
from scenenet.synthetic.corridor import Corridor

STRENGTHS = tuple(np.linspace(0, 1, 26).round(2).tolist())
"""Strengths of the annotation between which the wanted one is interpolated."""


@dataclass(frozen=True)
class NoisyLine:
    """The crops of a line in the order of its towers, labelled with some noise.

    Attributes:
        level: share of wrong tower points that was asked for.
        strength: ``annotation_noise`` that came nearest to it.
        share: the share there is: points labelled tower that are none, of all labelled tower.
        labelled: the crops as annotated.
        true: the same voxels with the truth.
    """

    level: float
    strength: float
    share: float
    labelled: list[VoxelSample]
    true: list[VoxelSample]


def noisy_lines(
    settings: SyntheticSettings, levels: Sequence[float], grid: VoxelSettings
) -> list[NoisyLine]:
    """One line at every level of noise; points and voxels are the same at all of them.

    A crop is every point within one tower height (planar) of a tower (thesis 5.1.3), around the
    true towers, so that it is the same crop whatever the labels.

    Raises:
        InputError: no strength of the annotation makes so many wrong labels.
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


def part_of(line: NoisyLine, first: int, last: int) -> NoisyLine:
    """The crops of the towers from number ``first`` to before ``last``, counted from 0."""
    return replace(line, labelled=line.labelled[first:last], true=line.true[first:last])


def _strengths(corridor: Corridor, levels: Sequence[float]) -> list[float]:
    """The strength of the annotation that each level takes on this line."""
    counts = np.zeros((len(STRENGTHS), 2))
    for index in range(len(corridor)):
        made = corridor.stretch_at(index, STRENGTHS)
        counts += [_tower_counts(stretch.labels, stretch.truth) for stretch in made]
    # Draws differ a little between strengths, so that a stronger one may do less by chance.
    shares = np.maximum.accumulate([_wrong_share(*both) for both in counts])
    if max(levels, default=0) > shares[-1]:
        raise InputError(
            f"no annotation of this line makes {max(levels):.0%} of its tower points wrong; the "
            f"strongest makes {shares[-1]:.0%}",
            remedy="Set label_noise.levels lower",
        )
    return [float(np.interp(level, shares, STRENGTHS)) if level else 0.0 for level in levels]


def _tower_counts(labels: np.ndarray, truth: np.ndarray) -> tuple[int, int]:
    """Points labelled tower, and those of them that are none."""
    tower = labels == TOWER
    return int(tower.sum()), int((tower & (truth != TOWER)).sum())


def _wrong_share(labelled: float, wrong: float) -> float:
    return float(wrong / max(labelled, 1))
