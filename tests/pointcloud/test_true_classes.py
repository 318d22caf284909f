"""True classes from a second file with the same points."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.core.errors import InputError
from scenenet.pointcloud import PointCloud, class_scheme, iter_chunks, read, write_las

EDP = class_scheme("edp")


def survey(path, xyz, codes):
    write_las(path, PointCloud(xyz, codes.astype(np.uint8), EDP))
    return path


@pytest.fixture
def points():
    rng = np.random.default_rng(0)
    origin = np.array([500_000, 4_630_000, 100])
    return origin + rng.uniform(0, 40, (1000, 3)), rng.integers(0, 20, 1000)


def test_every_chunk_has_labels_and_truth(points, tmp_path):
    xyz, codes = points
    labelled = survey(tmp_path / "labels.laz", xyz, codes)
    truth = survey(tmp_path / "truth.las", xyz, codes[::-1])
    chunks = list(iter_chunks(labelled, "edp", 300, truth))
    assert [len(chunk) for chunk in chunks] == [300, 300, 300, 100]
    np.testing.assert_array_equal(np.concatenate([c.classification for c in chunks]), codes)
    np.testing.assert_array_equal(np.concatenate([c.truth for c in chunks]), codes[::-1])
    np.testing.assert_array_equal(
        np.concatenate([c.is_true_tower for c in chunks]), codes[::-1] == 15
    )
    whole = read(labelled, "edp", truth)
    np.testing.assert_array_equal(whole.truth, codes[::-1])
    np.testing.assert_array_equal(whole.select(codes == 15).truth, codes[::-1][codes == 15])
    np.testing.assert_array_equal(whole.with_truth.classification, codes[::-1])


def test_a_survey_without_truth_says_so(points, tmp_path):
    cloud = read(survey(tmp_path / "labels.laz", *points), "edp")
    assert cloud.truth is None and cloud.is_true_tower is None and cloud.with_truth is None


def test_the_truth_may_be_a_sample(points, tmp_path):
    xyz, codes = points
    labelled = survey(tmp_path / "labels.laz", xyz, codes)
    np.save(tmp_path / "truth.npy", np.column_stack([xyz, codes[::-1]]))  # not rounded to mm
    np.testing.assert_array_equal(read(labelled, "edp", tmp_path / "truth.npy").truth, codes[::-1])


def test_another_number_of_points_is_refused_before_a_point_is_read(points, tmp_path):
    xyz, codes = points
    labelled = survey(tmp_path / "labels.laz", xyz, codes)
    truth = survey(tmp_path / "truth.laz", xyz[:-1], codes[:-1])
    with pytest.raises(
        InputError, match=r"truth\.laz: it has 999 points, but .*labels\.laz has 1000"
    ):
        iter_chunks(labelled, "edp", truth=truth)


@pytest.mark.parametrize("suffix", [".laz", ".npy"])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_point_elsewhere_is_named(points, tmp_path, axis, suffix):
    xyz, codes = points
    moved = xyz.copy()
    moved[[756, 900], axis] += 0.01
    labelled, truth = tmp_path / f"labels{suffix}", tmp_path / f"truth{suffix}"
    for path, places in ((labelled, xyz), (truth, moved)):
        if suffix == ".laz":
            survey(path, places, codes)
        else:
            np.save(path, np.column_stack([places, codes]))
    with pytest.raises(
        InputError, match=r"truth\.\w+: point 757: it lies at \(50.*labels"
    ) as error:
        list(iter_chunks(labelled, "edp", 100, truth))
    assert "in the same order" in str(error.value)


def test_points_in_another_order_are_refused(points, tmp_path):
    xyz, codes = points
    labelled = survey(tmp_path / "labels.laz", xyz, codes)
    truth = survey(tmp_path / "truth.laz", xyz[::-1], codes[::-1])
    with pytest.raises(InputError, match=r"truth\.laz: point 1: "):
        read(labelled, "edp", truth)


def test_truth_of_another_length_or_type_is_refused():
    xyz, codes = np.zeros((3, 3)), np.zeros(3, np.uint8)
    for truth in (codes[:2], codes.astype(int)):
        with pytest.raises(ValueError, match=r"truth must be \(3,\) uint8"):
            PointCloud(xyz, codes, EDP, truth=truth)
