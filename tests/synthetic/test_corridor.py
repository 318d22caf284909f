"""A synthetic corridor: what is in it, and that it is the same each time."""

from __future__ import annotations

import json

import numpy as np
import pytest
from pydantic import ValidationError

from scenenet.errors import InputError
from scenenet.pointcloud.schemes import EDP
from scenenet.synthetic import SyntheticSettings, corridor_cloud, make_corridor, make_survey

SMALL = {"towers": 3, "span": 50.0, "span_spread": 3.0, "half_width": 14.0, "density": 12.0}
TOWER, WIRE = 15, 16


def small(**changes) -> SyntheticSettings:
    return SyntheticSettings(**(SMALL | changes))


@pytest.fixture(scope="module")
def default():
    """The default survey: settings, cloud as annotated, true classes, true towers."""
    settings = SyntheticSettings()
    return settings, *corridor_cloud(settings)


def test_same_seed_same_points():
    (a, truth_a, towers_a), (b, truth_b, towers_b) = (corridor_cloud(small()) for _ in range(2))
    assert a.xyz.tobytes() == b.xyz.tobytes()
    assert a.classification.tobytes() == b.classification.tobytes()
    assert truth_a.tobytes() == truth_b.tobytes()
    assert towers_a == towers_b


def test_other_seed_other_corridor():
    (a, _, towers_a), (b, _, towers_b) = (corridor_cloud(small(seed=s)) for s in (1, 2))
    assert len(a) != len(b) or not np.array_equal(a.xyz, b.xyz)
    assert towers_a[1].x != towers_b[1].x


def test_order_of_the_kinds_in_a_file_does_not_matter():
    kinds = {"tubular": 0.5, "wooden": 0.3, "lattice": 0.2}
    a, b = (make_corridor(small(kinds=k)).towers for k in (kinds, dict(sorted(kinds.items()))))
    assert a == b


def test_a_stretch_does_not_depend_on_the_others():
    in_turn = list(make_corridor(small()))[2]
    alone = make_corridor(small()).stretch(2)
    np.testing.assert_array_equal(in_turn.xyz, alone.xyz)
    np.testing.assert_array_equal(in_turn.labels, alone.labels)


def test_stretches_meet_without_gap_or_overlap():
    settings = small(bend_share=1.0, bend=35.0, low_strays=0, high_strays=0, density=30.0)
    corridor = make_corridor(settings)
    inside = np.zeros(20_000, int)
    middle = corridor.line.nodes[2]
    x, y = (middle + np.random.default_rng(0).uniform(-12, 12, (20_000, 2))).T
    near = np.hypot(x - middle[0], y - middle[1]) < 12
    for k in range(len(corridor)):
        inside += corridor.line.strip(k).holds(x, y)
    assert np.mean(inside[near] == 1) > 0.999


def test_ground_goes_on_across_the_border_of_stretches():
    settings = small(low_strays=0, high_strays=0, tree_cover=0, bush_cover=0, low_vegetation=0,
                     clutter=0, ranging_noise=0, relief=80)  # fmt: skip
    corridor = make_corridor(settings)
    origin = np.array([settings.easting, settings.northing])
    for stretch in corridor:
        ground = stretch.xyz[np.isin(stretch.truth, (2, 10, 11, 19))]
        x, y = (ground[:, :2] - origin).T
        np.testing.assert_allclose(ground[:, 2], corridor.terrain.height(x, y), atol=1e-6)


def test_a_longer_line_costs_no_more_per_stretch():
    sizes = [np.mean([len(s.xyz) for s in make_corridor(small(towers=n))]) for n in (2, 8)]
    assert sizes[1] < 2 * sizes[0]


def test_survey_has_as_many_points_and_towers_as_real_crops(default):
    settings, cloud, _, towers = default
    assert len(towers) == settings.towers
    assert 1_000_000 < len(cloud) < 3_500_000
    for tower in towers:
        assert settings.height[0] <= tower.height <= settings.height[1]
        near = np.hypot(cloud.xyz[:, 0] - tower.x, cloud.xyz[:, 1] - tower.y) < tower.height
        assert 25_000 < near.sum() < 160_000
        # Stray returns stretch the box of a crop far above its tower.
        assert np.ptp(cloud.xyz[near, 2]) > 2 * tower.height
    assert len({tower.type for tower in towers}) >= 3


def test_every_tower_has_its_points_within_its_height(default):
    _, cloud, truth, towers = default
    points = cloud.xyz[truth == TOWER]
    owner = np.full(len(points), -1)
    for tower in towers:
        own = np.hypot(points[:, 0] - tower.x, points[:, 1] - tower.y) < 8
        owner[own] = tower.id
        above = points[own, 2] - tower.base
        assert own.sum() >= 250
        assert above.max() == pytest.approx(tower.height, abs=0.8)
        assert above.min() > -0.6 * 4
    assert (owner > 0).all(), "no tower points but at towers"


def test_wires_run_from_tower_to_tower_above_the_ground():
    corridor = make_corridor(small(bend_share=0.5, relief=60))
    for stretch in list(corridor)[1:-1]:
        k = stretch.index
        before, after = corridor.line.support(k), corridor.line.support(k + 1)
        wires = stretch.xyz[stretch.truth == WIRE]
        wires = wires - [corridor.settings.easting, corridor.settings.northing, 0]
        for support in (before, after):
            for held in support.attachments:
                assert np.linalg.norm(wires - held, axis=1).min() < 3.0
        ground = corridor.terrain.height(wires[:, 0], wires[:, 1])
        assert (wires[:, 2] - ground).min() > 4
        highest = max(before.attachments[:, 2].max(), after.attachments[:, 2].max())
        assert wires[:, 2].max() < highest + 0.1


def test_labels_without_annotation_noise_are_the_truth():
    cloud, truth, _ = corridor_cloud(small(annotation_noise=0.0))
    np.testing.assert_array_equal(cloud.classification, truth)


def test_about_half_of_the_tower_labels_are_wrong_by_default(default):
    _, cloud, truth, towers = default
    labelled = cloud.is_tower
    assert 0.3 < (truth[labelled] != TOWER).mean() < 0.6
    assert labelled[truth == TOWER].all(), "annotators miss no tower points"
    wrong = cloud.xyz[labelled & (truth != TOWER)]
    distance = np.min([np.hypot(wrong[:, 0] - t.x, wrong[:, 1] - t.y) for t in towers], axis=0)
    assert distance.max() < 12
    wrong_classes = truth[labelled & (truth != TOWER)]
    assert np.isin(wrong_classes, (2, 10, 11, 19)).mean() > 0.5, "mostly ground patches"
    assert (wrong_classes == WIRE).sum() > 100, "and wire ends"


def test_stronger_annotation_noise_labels_more():
    counts = [corridor_cloud(small(annotation_noise=s))[0].is_tower.sum() for s in (0, 0.3, 1)]
    assert counts[0] < counts[1] < counts[2]


def test_classes_are_edp_codes_with_the_bulk_where_the_thesis_has_it(default):
    _, cloud, truth, _ = default
    for codes in (cloud.classification, truth):
        assert set(np.unique(codes).tolist()) <= set(EDP.classes)
    assert set(np.unique(truth).tolist()) == {1, 2, 3, 4, 5, 7, 10, 11, 12, 15, 16, 19}
    share = np.bincount(cloud.classification, minlength=22) / len(cloud)
    # Thesis Table 5.1: 87 % in classes 10, 11 and 12, 0.5 % tower, 0.9 % wire.
    assert share[[10, 11, 12]].sum() > 0.7
    assert 0.002 < share[TOWER] < 0.02
    assert 0.002 < share[WIRE] < 0.02
    assert share[[1, 2, 3, 4, 5, 7, 19]].max() < 0.15


def test_dbscan_of_the_thesis_finds_every_tower(default):
    from sklearn.cluster import DBSCAN

    _, cloud, _, towers = default
    points = cloud.xyz[cloud.is_tower]
    # Thinned to 1 m cells with weights: the same clusters in a fraction of the memory.
    cells, count = np.unique(np.floor(points), axis=0, return_counts=True)
    found = DBSCAN(eps=10.0, min_samples=300).fit(cells, sample_weight=count).labels_
    assert set(found.tolist()) - {-1} == set(range(len(towers)))


def test_crowns_let_pulses_through_to_the_ground():
    settings = small(tree_cover=1.0, bush_cover=0, clutter=0, penetration=0.3, density=30)
    _, truth, _ = corridor_cloud(settings)
    ground, tall = np.isin(truth, (2, 10, 19)).sum(), (truth == 12).sum()
    assert 0.05 < ground / tall < 0.6
    bare = corridor_cloud(settings.model_copy(update={"tree_cover": 0.0}))[1]
    assert np.isin(bare, (5, 12)).sum() < 0.02 * tall


def test_single_tower_is_a_survey_too():
    cloud, truth, towers = corridor_cloud(small(towers=1))
    assert len(towers) == 1
    assert (truth == TOWER).sum() > 200
    assert np.ptp(cloud.xyz[:, :2], axis=0).max() < 120


def test_truth_file_has_the_same_points_in_the_same_order(tmp_path):
    from scenenet.pointcloud import read

    out, truth, towers = (tmp_path / n for n in ("s.laz", "s.truth.laz", "s.towers.geojson"))
    settings = small()
    summary = make_survey(settings, out, truth, towers)
    a, b = read(out, codes="edp"), read(truth, codes="edp")
    cloud, true_classes, listed = corridor_cloud(settings)
    assert summary["points"] == len(a) == len(b) == len(cloud)
    np.testing.assert_array_equal(a.xyz, b.xyz)
    np.testing.assert_allclose(a.xyz, cloud.xyz, atol=0.0006)
    np.testing.assert_array_equal(a.classification, cloud.classification)
    np.testing.assert_array_equal(b.classification, true_classes)
    assert a.crs.to_epsg() == 32629
    collection = json.loads(towers.read_text())
    assert collection["crs"]["properties"]["name"].endswith("32629")
    assert [f["properties"]["type"] for f in collection["features"]] == [t.type for t in listed]
    first = collection["features"][0]
    assert set(first["properties"]) == {"id", "x", "y", "base", "height", "type"}
    assert first["geometry"]["coordinates"] == [first["properties"]["x"], first["properties"]["y"]]


@pytest.mark.parametrize("epsg", [1, 4326])
def test_a_crs_without_metres_is_refused(epsg):
    with pytest.raises(InputError, match=f"EPSG:{epsg}"):
        make_corridor(small(epsg=epsg))


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"kinds": {"lattice": 0.0}}, "kinds"),
        ({"kinds": {"windmill": 1.0}}, "windmill"),
        ({"height": (20.0, 10.0)}, "height"),
        ({"half_width": 150.0, "bend": 60.0}, "corridor"),
        ({"towers": 0}, "towers"),
        ({"tree_share": 0.3}, "tree_share"),
    ],
)
def test_settings_that_make_no_corridor_are_refused(changes, word):
    with pytest.raises(ValidationError, match=word):
        small(**changes)
