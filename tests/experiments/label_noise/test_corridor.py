"""The share of wrong labels is the requested one, and nothing else differs."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.core.errors import InputError
from scenenet.dataset.voxels import VoxelSettings
from scenenet.experiments.label_noise.corridor import noisy_lines
from scenenet.synthetic import corridor_cloud, make_corridor
from scenenet.synthetic.codes import TOWER

GRID = VoxelSettings(resolution=32)


def test_a_stretch_at_many_strengths_is_each_corridors_own(line):
    strengths = [0.0, 0.3, 0.8]
    (_, *several) = make_corridor(line).stretch_at(2, [0.5, *strengths])
    for strength, made in zip(strengths, several, strict=True):
        alone = make_corridor(line.model_copy(update={"annotation_noise": strength})).stretch(2)
        np.testing.assert_array_equal(made.xyz, alone.xyz)
        np.testing.assert_array_equal(made.labels, alone.labels)
        np.testing.assert_array_equal(made.truth, alone.truth)


def test_the_share_of_wrong_labels_is_the_requested_one(line):
    levels = (0, 0.2, 0.4, 0.6)
    lines = noisy_lines(line, levels, GRID)
    assert [made.level for made in lines] == list(levels)
    for made in lines:
        assert made.share == pytest.approx(made.level, abs=0.04)
        # Counted anew on the corridor that has this annotation.
        settings = line.model_copy(update={"annotation_noise": made.strength})
        cloud, truth, _ = corridor_cloud(settings)
        tower = cloud.classification == TOWER
        assert np.mean(truth[tower] != TOWER) == pytest.approx(made.share, abs=1e-9)
    assert lines[0].share == lines[0].strength == 0


def test_voxels_are_the_same_and_labels_are_not(line):
    clean, noisy = noisy_lines(line, (0, 0.5), GRID)
    assert len(clean.labelled) == len(noisy.labelled) == 8
    cloud, _, towers = corridor_cloud(line)
    for labelled, wrong, true, tower in zip(
        clean.labelled, noisy.labelled, noisy.true, towers, strict=True
    ):
        assert labelled.id == wrong.id == true.id
        np.testing.assert_array_equal(wrong.index, true.index)
        np.testing.assert_array_equal(wrong.count, true.count)
        np.testing.assert_array_equal(labelled.labelled, true.labelled)
        assert (wrong.labelled & ~true.labelled).any()
        assert not (true.labelled & ~wrong.labelled).any()  # annotators overlook nothing
        near = np.hypot(cloud.xyz[:, 0] - tower.x, cloud.xyz[:, 1] - tower.y) <= tower.height
        assert true.count.sum() == near.sum()
        assert true.labelled.any()


def test_an_unreachable_share_of_wrong_labels_is_refused(line):
    with pytest.raises(InputError, match=r"no annotation noise .* 97%"):
        noisy_lines(line, (0, 0.97), GRID)
