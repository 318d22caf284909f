"""A synthetic corridor: its content and its reproducibility."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from scenenet.core.errors import InputError
from scenenet.pointcloud.class_schemes import EDP
from scenenet.synthetic import corridor_cloud, make_corridor
from scenenet.synthetic.codes import (
    BARE,
    BARE_TOO,
    CONDUCTOR,
    GROUND,
    ON_GROUND,
    TALL,
    TOWER,
    TREE,
)
from scenenet.synthetic.scene.line import skewed


def test_same_seed_same_points(small):
    (a, truth_a, towers_a), (b, truth_b, towers_b) = (corridor_cloud(small()) for _ in range(2))
    assert a.xyz.tobytes() == b.xyz.tobytes()
    assert a.classification.tobytes() == b.classification.tobytes()
    assert truth_a.tobytes() == truth_b.tobytes()
    assert towers_a == towers_b


def test_other_seed_other_corridor(small):
    (a, _, towers_a), (b, _, towers_b) = (corridor_cloud(small(seed=s)) for s in (1, 2))
    assert len(a) != len(b) or not np.array_equal(a.xyz, b.xyz)
    assert towers_a[1].x != towers_b[1].x


def test_order_of_the_kinds_in_a_file_does_not_matter(small):
    kinds = {"tubular": 0.5, "wooden": 0.3, "lattice": 0.2}
    a, b = (make_corridor(small(kinds=k)).towers for k in (kinds, dict(sorted(kinds.items()))))
    assert a == b


def test_a_stretch_does_not_depend_on_the_others(small):
    in_turn = list(make_corridor(small()))[2]
    alone = make_corridor(small()).stretch(2)
    np.testing.assert_array_equal(in_turn.xyz, alone.xyz)
    np.testing.assert_array_equal(in_turn.labels, alone.labels)


def test_stretches_meet_without_gap_or_overlap(small):
    corridor = make_corridor(small(bend_share=1.0, bend=35.0))
    inside = np.zeros(20_000, int)
    middle = corridor.line.nodes[2]
    x, y = (middle + np.random.default_rng(0).uniform(-11, 11, (20_000, 2))).T
    near = np.hypot(x - middle[0], y - middle[1]) < 11
    for k in range(len(corridor)):
        for strip in corridor.line.strips(k):
            inside += strip.holds(x, y)
    assert np.mean(inside[near] == 1) > 0.999


def test_ground_continues_across_the_border_of_stretches(bare):
    settings = bare(relief=80)
    corridor = make_corridor(settings)
    origin = np.array([settings.easting, settings.northing])
    for stretch in corridor:
        ground = stretch.xyz[np.isin(stretch.truth, ON_GROUND)]
        assert len(ground) > 100
        x, y = (ground[:, :2] - origin).T
        np.testing.assert_allclose(ground[:, 2], corridor.terrain.height(x, y), atol=1e-6)


def test_single_towers_have_the_points_around_them_and_nothing_between(small):
    around = {"section": 1, "margin": 14.0, "half_width": 14.0, "span": 90.0}
    settings = small(towers=5, **around)
    corridor = make_corridor(settings)
    xyz = np.concatenate([stretch.xyz for stretch in corridor])
    feet = np.array([[tower.x, tower.y] for tower in corridor.towers])
    apart = np.linalg.norm(xyz[:, None, :2] - feet, axis=2)
    assert apart.min(axis=1).max() <= 14
    # Of each disc nothing is missing: as many points on either side of the tower.
    for foot, tower in zip(feet, corridor.towers, strict=True):
        near = xyz[np.linalg.norm(xyz[:, :2] - foot, axis=1) < 14, :2] - foot
        azimuth = corridor.line.support(tower.id).azimuth
        ahead = (near @ [np.cos(azimuth), np.sin(azimuth)] > 0).mean()
        assert 0.3 < ahead < 0.7
        assert len(near) > 0.5 * settings.density * np.pi * 14**2


@pytest.mark.parametrize(("low", "high", "mean"), [(18, 40, 34.74), (245, 500, 300), (10, 20, 15)])
def test_skewed_numbers_stay_between_their_limits_and_have_their_mean(low, high, mean):
    numbers = skewed((low, high), mean, np.linspace(0, 1, 100_001))
    assert (numbers.min(), numbers.max()) == (low, high)
    assert numbers.mean() == pytest.approx(mean, rel=1e-3)


def test_towers_of_a_line_have_the_statistics_of_the_settings(small):
    settings = small(
        towers=400, height=(18, 40), height_mean=34.74, span=300, span_limits=(245, 500),
        catenary=5000, section=1, relief=0,
    )  # fmt: skip
    corridor = make_corridor(settings)
    heights = np.array([tower.height for tower in corridor.towers])
    spans = corridor.line.spans
    assert heights.mean() == pytest.approx(34.74, abs=0.8)
    assert 18 <= heights.min() < 22 and 39 < heights.max() <= 40
    assert spans.mean() == pytest.approx(300, abs=10)
    assert spans.min() >= 245 and spans.max() <= 500


def test_survey_ends_at_a_tower_of_each_section(small):
    settings = small(towers=30, section=3, margin=0.5)
    corridor = make_corridor(settings)
    gaps = [k for k in range(1, 30) if len(corridor.line.strips(k)) == 2]
    assert 5 <= len(gaps) <= 14
    whole = make_corridor(small(towers=30, margin=0.5))
    assert not [k for k in range(1, 30) if len(whole.line.strips(k)) == 2]
    assert corridor.length < 0.85 * whole.length
    stretch = corridor.stretch(gaps[0])
    assert len(stretch.xyz) < 0.2 * len(whole.stretch(gaps[0]).xyz)
    before, after = (corridor.line.nodes[gaps[0] + k] for k in (0, 1))
    local = stretch.xyz[:, :2] - [settings.easting, settings.northing]
    nearest = np.minimum(*(np.linalg.norm(local - node, axis=1) for node in (before, after)))
    assert nearest.max() < np.hypot(settings.half_width, 4.0)


def test_a_longer_line_costs_no_more_per_stretch(small):
    sizes = [np.mean([len(s.xyz) for s in make_corridor(small(towers=n))]) for n in (2, 8)]
    assert sizes[1] < 2 * sizes[0]


def test_crops_have_as_many_points_as_real_ones(default):
    settings, cloud, _, towers = default
    assert len(towers) == settings.towers
    counts = []
    for tower in towers:
        assert settings.height[0] <= tower.height <= settings.height[1]
        near = np.hypot(cloud.xyz[:, 0] - tower.x, cloud.xyz[:, 1] - tower.y) < tower.height
        counts.append(near.sum())
        # Stray returns stretch the box of a crop far above its tower.
        assert np.ptp(cloud.xyz[near, 2]) > 1.8 * tower.height
    # 36 000 to 94 000 in the public crops.
    assert 30_000 < np.median(counts) < 110_000
    assert min(counts) > 15_000
    assert len({tower.type for tower in towers}) >= 3


def test_truth_agrees_with_the_points(default):
    _, cloud, truth, towers = default
    points = cloud.xyz[truth == TOWER]
    owner = np.full(len(points), -1)
    for tower in towers:
        own = np.hypot(points[:, 0] - tower.x, points[:, 1] - tower.y) < 8
        owner[own] = tower.id
        above = points[own, 2] - tower.base
        assert own.sum() >= 100
        assert above.max() == pytest.approx(tower.height, abs=0.8)
        assert above.min() > -2.5
    assert (owner > 0).all(), "no tower points but at towers"


def test_conductors_run_from_tower_to_tower_above_the_ground(small):
    corridor = make_corridor(small(bend_share=0.5, relief=60))
    for stretch in list(corridor)[1:-1]:
        k = stretch.index
        before, after = corridor.line.support(k), corridor.line.support(k + 1)
        conductors = stretch.xyz[stretch.truth == CONDUCTOR]
        conductors = conductors - [corridor.settings.easting, corridor.settings.northing, 0]
        for support in (before, after):
            for held in support.ahead:
                assert np.linalg.norm(conductors - held, axis=1).min() < 3.0
        ground = corridor.terrain.height(conductors[:, 0], conductors[:, 1])
        assert (conductors[:, 2] - ground).min() > 4
        highest = max(before.ahead[:, 2].max(), after.behind[:, 2].max())
        assert conductors[:, 2].max() < highest + 0.1


def test_classes_are_edp_codes_with_the_bulk_where_the_thesis_has_it(default):
    _, cloud, truth, _ = default
    for codes in (cloud.classification, truth):
        assert set(np.unique(codes).tolist()) <= set(EDP.classes)
    assert set(np.unique(truth).tolist()) == {1, 2, 3, 4, 5, 7, 10, 11, 12, 15, 16, 19}
    share = np.bincount(cloud.classification, minlength=22) / len(cloud)
    # Thesis Table 5.1: 87 % in classes 10, 11 and 12, 0.5 % tower, 0.9 % conductor.
    assert share[[10, 11, 12]].sum() > 0.7
    assert 0.002 < share[TOWER] < 0.02
    assert 0.002 < share[CONDUCTOR] < 0.02
    assert share[[1, 2, 3, 4, 5, 7]].max() < 0.08


def test_dbscan_of_the_thesis_finds_every_tower(default):
    from scenenet.dataset.labelled_towers import TowerSettings, find_towers

    _, cloud, _, towers = default
    found = find_towers(cloud.xyz[cloud.is_tower], TowerSettings()).towers
    assert len(found) == len(towers)
    for row in found.itertuples():
        away = [np.hypot(row.x - t.x, row.y - t.y) for t in towers]
        assert min(away) < 1.5


def test_single_tower_is_a_survey_too(small):
    cloud, truth, towers = corridor_cloud(small(towers=1))
    assert len(towers) == 1
    assert (truth == TOWER).sum() > 100
    assert np.ptp(cloud.xyz[:, :2], axis=0).max() < 120


def test_crowns_let_pulses_through_to_the_ground(small):
    forest = {"tree_cover": 1.0, "bush_cover": 0, "hedges": 0, "clutter": 0, "density": 30}
    shares = []
    for penetration in (0.02, 0.3):
        truth = corridor_cloud(small(**forest, penetration=penetration))[1]
        ground, tall = np.isin(truth, ON_GROUND).sum(), np.isin(truth, (TREE, TALL)).sum()
        shares.append(ground / tall)
    assert 0.05 < shares[0] < 0.8 * shares[1]
    bare = corridor_cloud(small(**forest | {"tree_cover": 0.0, "other_lines": 0.0}))[1]
    assert np.isin(bare, (TREE, TALL)).sum() < 0.02 * tall


@pytest.mark.parametrize("epsg", [1, 4326])
def test_a_crs_without_metres_is_refused(small, epsg):
    with pytest.raises(InputError, match=f"EPSG:{epsg}"):
        make_corridor(small(epsg=epsg))


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"kinds": {"lattice": 0.0}}, "kinds"),
        ({"kinds": {"windmill": 1.0}}, "windmill"),
        ({"clutter_kinds": {"crane": 0.0}}, "clutter_kinds"),
        ({"height": (20.0, 10.0)}, "height"),
        ({"flight_height": (20.0, 10.0)}, "flight_height"),
        ({"half_width": 150.0, "bend": 60.0}, "corridor"),
        ({"section": 4, "margin": 30.0}, "margin"),
        ({"height": (18, 40), "height_mean": 41.0}, "height_mean"),
        ({"span_limits": (245, 500), "span": 240.0}, "span"),
        ({"span_limits": (500, 245), "span": 300.0}, "span_limits"),
        ({"roads": 0.8, "rails": 0.4}, "rails"),
        ({"towers": 0}, "towers"),
        ({"tree_share": 0.3}, "tree_share"),
    ],
)
def test_settings_that_make_no_corridor_are_refused(small, changes, word):
    with pytest.raises(ValidationError, match=word):
        small(**changes)


def test_shares_of_ground_classes_follow_the_settings(small):
    def share(code, **changes):
        _, truth, _ = corridor_cloud(small(low_vegetation=0.0, tree_cover=0.0, **changes))
        ground = np.isin(truth, (GROUND, BARE, BARE_TOO))
        return (truth == code).sum() / ground.sum()

    assert share(BARE_TOO, lower_ground=0.15) < 0.75 * share(BARE_TOO)
    assert share(BARE_TOO, lower_ground=0.0) < share(BARE_TOO, lower_ground=0.15)
    assert share(GROUND, key_points=0.0) == 0 < share(GROUND)
