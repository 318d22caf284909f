"""Annotation noise: its shape, its share and its strength."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.synthetic import corridor_cloud, make_corridor
from scenenet.synthetic.codes import (
    BARE,
    BARE_TOO,
    CONDUCTOR,
    GROUND,
    LOW,
    SCRUB,
    TALL,
    TOWER,
    TREE,
)


def test_labels_without_annotation_noise_are_the_truth(small):
    cloud, truth, _ = corridor_cloud(small(annotation_noise=0.0))
    np.testing.assert_array_equal(cloud.classification, truth)


def test_about_half_of_the_tower_labels_are_wrong_by_default(default):
    _, cloud, truth, _ = default
    labelled = cloud.is_tower
    assert 0.35 < (truth[labelled] != TOWER).mean() < 0.7
    assert labelled[truth == TOWER].all(), "annotators miss no tower points"
    wrong_classes = truth[labelled & (truth != TOWER)]
    assert (wrong_classes == LOW).sum() > 500, "grass and scrub at the foot"
    assert (wrong_classes == CONDUCTOR).sum() > 200, "and ends of conductors"


@pytest.mark.parametrize(("kind", "ground_too"), [("lattice_pole", False), ("lattice", True)])
def test_poles_and_pylons_have_wrong_labels_of_their_own_kind(small, kind, ground_too):
    settings = small(kinds={kind: 1.0}, low_vegetation=0.4, density=50)
    cloud, truth, _ = corridor_cloud(settings)
    wrong = truth[cloud.is_tower & (truth != TOWER)]
    assert 0.2 < len(wrong) / cloud.is_tower.sum() < 0.85
    assert np.isin(wrong, (GROUND, BARE, BARE_TOO)).any() == ground_too
    assert np.isin(wrong, (SCRUB, TREE, LOW, TALL, CONDUCTOR)).any()


def test_wrong_labels_lie_in_a_prism_along_the_line(small):
    settings = small(kinds={"tubular": 1.0}, low_vegetation=0.6, density=40, roads=0.0)
    cloud, truth, towers = corridor_cloud(settings)
    wrong = cloud.xyz[cloud.is_tower & (truth != TOWER)]
    line = make_corridor(settings).line
    sides = []
    for tower in towers:
        dx, dy = wrong[:, 0] - tower.x, wrong[:, 1] - tower.y
        near = np.hypot(dx, dy) < 8
        cos, sin = np.cos(line.support(tower.id).azimuth), np.sin(line.support(tower.id).azimuth)
        sides.append(np.abs([dx * cos + dy * sin, dy * cos - dx * sin])[:, near])
    sides = np.concatenate(sides, axis=1)
    assert sides.shape[1] == len(wrong) > 300
    # 1.9 m to each side, a tenth more or less and a little aside, by hand.
    assert 1.5 < np.percentile(sides, 98) < sides.max() < 2.4


@pytest.mark.parametrize("kind", ["tubular", "lattice"])
def test_stronger_annotation_noise_labels_more(small, kind):
    shares = []
    for strength in (0.1, 0.5, 1.0):
        settings = small(annotation_noise=strength, kinds={kind: 1.0}, density=40)
        cloud, truth, _ = corridor_cloud(settings)
        shares.append((truth[cloud.is_tower] != TOWER).mean())
    assert 0 < shares[0] < shares[1] < shares[2] < 1
