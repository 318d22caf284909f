"""Labelled towers: instances and their properties."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from sklearn.cluster import DBSCAN
from sklearn.metrics import adjusted_rand_score

from scenenet.core.errors import InputError
from scenenet.dataset.labelled_towers import (
    COLUMNS,
    TowerSettings,
    cluster,
    find_towers,
    line_order,
    survey_towers,
)
from scenenet.pointcloud import PointCloud, class_scheme, write_las

SETTINGS = TowerSettings()
ORIGIN = np.array([500_000.0, 4_630_000.0, 100.0])


def box(x: float, y: float, *, width=2.0, length=4.0, height=20.0, n=4000, turn=0.0, seed=0):
    """Points (n, 3) in a box that stands on the ground at (x, y); ``turn`` about z, radians."""
    rng = np.random.default_rng(seed)
    corner = rng.uniform(-0.5, 0.5, (n, 2)) * [length, width]
    cos, sin = np.cos(turn), np.sin(turn)
    plan = corner @ np.array([[cos, sin], [-sin, cos]])
    z = np.append(rng.uniform(0, height, n - 2), [0.0, height])
    return np.column_stack([plan + np.array([x, y]), z]) + ORIGIN


def test_without_tower_points_there_are_no_towers():
    table = find_towers(np.empty((0, 3)), SETTINGS).towers
    assert len(table) == 0
    assert tuple(table.columns) == COLUMNS


@pytest.mark.parametrize("turn", [0.0, 0.6])
def test_a_box_has_the_properties_it_was_generated_with(turn):
    tower = find_towers(box(7.0, -3.0, turn=turn), SETTINGS).towers.iloc[0]
    assert tower["height"] == pytest.approx(20.0)
    assert tower["base"] == pytest.approx(100.0)
    assert tower["top"] == pytest.approx(120.0)
    assert [tower["x"], tower["y"]] == pytest.approx((500_007.0, 4_629_997.0), abs=0.3)
    assert tower["width"] == pytest.approx(2.0, abs=0.3)
    assert tower["length"] == pytest.approx(4.0, abs=0.4)
    assert tower["points"] == 4000
    assert np.isnan(tower["spacing"])


@pytest.mark.parametrize("turn", [0.0, 0.4, np.pi / 4])
def test_a_square_base_is_as_wide_as_its_sides_and_not_as_its_diagonal(turn):
    found = find_towers(box(0, 0, width=4.0, length=4.0, turn=turn), TowerSettings()).towers
    assert found["width"][0] == pytest.approx(3.9, abs=0.15)
    assert found["length"][0] == pytest.approx(3.9, abs=0.15)


def test_the_side_with_more_points_does_not_shift_the_centre():
    even = box(0, 0, n=4000)
    one_side = box(0, 0, n=40_000, seed=1)
    one_side = one_side[one_side[:, 0] > ORIGIN[0] + 1]
    tower = find_towers(np.concatenate([even, one_side]), SETTINGS).towers.iloc[0]
    assert tower["x"] == pytest.approx(ORIGIN[0], abs=0.3)


def test_towers_50_m_apart_are_two():
    table = find_towers(np.concatenate([box(0, 0), box(50, 0)]), SETTINGS).towers
    assert table["tower"].tolist() == [1, 2]
    assert table["spacing"].iloc[0] == pytest.approx(50, abs=0.5)
    assert np.isnan(table["spacing"].iloc[1])


def test_points_nearer_than_eps_are_one_tower():
    assert len(find_towers(np.concatenate([box(0, 0), box(12, 0)]), SETTINGS).towers) == 1


def test_a_few_stray_points_are_not_a_tower():
    stray = box(60, 0, n=100, height=2.0)
    labels = cluster(np.concatenate([box(0, 0), stray]), SETTINGS).tower
    assert set(labels[:4000]) == {0}
    assert set(labels[4000:]) == {-1}


@pytest.mark.parametrize("seed", range(4))
def test_clusters_of_thinned_points_are_those_of_all_points(seed):
    rng = np.random.default_rng(seed)
    places = rng.uniform(0, 150, (6, 2))
    parts = [box(*p, n=int(rng.integers(200, 1500)), seed=seed) for p in places]
    noise = rng.uniform([0, 0, 0], [150, 150, 40], (60, 3)) + ORIGIN
    xyz = rng.permutation(np.concatenate([*parts, noise]))
    plain = DBSCAN(eps=SETTINGS.eps, min_samples=SETTINGS.min_points).fit_predict(xyz)
    dense_alone = TowerSettings(sparse_points=len(xyz))
    thinned = cluster(xyz, dense_alone).tower
    # Points at the edge of a cluster may differ, because a cell represents all of its points.
    surely = (plain >= 0) & (thinned >= 0)
    assert adjusted_rand_score(plain[surely], thinned[surely]) == 1.0
    assert len(set(plain)) == len(set(thinned))
    assert np.mean((plain < 0) != (thinned < 0)) < 0.01


def test_order_of_points_does_not_matter():
    xyz = np.concatenate([box(0, 0), box(80, 10), box(160, 0, n=3000)])
    shuffled = np.random.default_rng(0).permutation(xyz)
    one, other = find_towers(xyz, SETTINGS), find_towers(shuffled, SETTINGS)
    pd.testing.assert_frame_equal(one.towers, other.towers)


def test_towers_are_numbered_along_the_line():
    xs = [200, 0, 300, 100]
    table = find_towers(np.concatenate([box(x, 0.1 * x) for x in xs]), SETTINGS).towers
    x = table["x"].to_numpy()
    assert np.all(np.diff(x) > 0) or np.all(np.diff(x) < 0)
    np.testing.assert_allclose(table["spacing"][:-1], np.hypot(100, 10), atol=0.5)


def test_a_line_around_a_bend_is_followed():
    line = np.array([[0, 0], [100, 0], [200, 0], [270, 70], [270, 170], [270, 270]], float)
    mixed = np.array([3, 0, 5, 1, 4, 2])
    order = line_order(line[mixed])
    along = mixed[order].tolist()
    assert along in ([0, 1, 2, 3, 4, 5], [5, 4, 3, 2, 1, 0])


def test_only_points_labelled_tower_are_used(tmp_path):
    conductor = box(80, 0)
    xyz = np.concatenate([box(0, 0), conductor])
    codes = np.repeat([15, 16], 4000).astype(np.uint8)
    write_las(tmp_path / "survey.laz", PointCloud(xyz, codes))
    assert len(survey_towers(tmp_path / "survey.laz", "edp", SETTINGS).towers) == 1


def test_a_survey_without_towers_gives_an_empty_table(tmp_path):
    cloud = PointCloud(box(0, 0), np.full(4000, 2, np.uint8), class_scheme("edp"))
    write_las(tmp_path / "survey.laz", cloud)
    table = survey_towers(tmp_path / "survey.laz", "edp", SETTINGS).towers
    assert len(table) == 0
    assert tuple(table.columns) == COLUMNS


def test_samples_of_a_folder_are_separate_crops(tmp_path):
    for name, x in [("sample_a", 0.0), ("sample_b", 100.0)]:
        xyz = box(x, 0)
        np.save(tmp_path / f"{name}.npy", np.column_stack([xyz, np.full(len(xyz), 15.0)]))
    table = survey_towers(tmp_path, "edp", SETTINGS).towers
    assert table["tower"].tolist() == [1, 2]
    assert table["sample"].tolist() == ["sample_a", "sample_b"]
    assert table["spacing"].isna().all()


def test_a_folder_without_samples_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"no TS40K sample.*\.npy or \.pt"):
        survey_towers(tmp_path, "edp", SETTINGS)


def test_towers_of_a_thin_survey_are_towers():
    places = [(0, 0), (80, 10), (160, 0)]
    xyz = np.concatenate([box(x, y, n=40) for x, y in places])
    found = find_towers(xyz, SETTINGS)
    assert len(found.towers) == 3
    assert found.towers["points"].tolist() == [40, 40, 40]
    assert len(found.left_out) == 0


def test_a_thin_tower_among_dense_ones_is_a_tower():
    xyz = np.concatenate([box(0, 0, n=3000), box(80, 0, n=3000), box(160, 0, n=60)])
    assert find_towers(xyz, SETTINGS).towers["points"].tolist() == [3000, 3000, 60]


def test_points_that_are_no_tower_are_named_with_the_reason():
    rng = np.random.default_rng(0)
    low = rng.uniform([200, 0, 0], [201.5, 1.5, 1.5], (50, 3))
    beside = box(15, 0, n=60)
    scattered = np.array([[400.0, 0, 0], [450.0, 0, 0]])
    found = find_towers(np.concatenate([box(0, 0, n=3000), low, beside, scattered]), SETTINGS)
    assert found.towers["points"].tolist() == [3000]
    assert sorted(found.left_out["points"]) == [2, 50, 60]
    assert len(found.notes()) == 3
    notes = "\n".join(found.notes())
    assert "50 points labelled tower about x 200" in notes
    assert "less than 4 m" in notes
    assert "beside a tower with more points" in notes
    assert "fewer than 10 of them lie within 10 m" in notes
