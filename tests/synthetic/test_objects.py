"""Every kind of object can be switched on and off."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.synthetic import corridor_cloud, make_corridor
from scenenet.synthetic.codes import CONDUCTOR, LOW, ON_GROUND, STRAY, TALL, TOWER, TREE, WATER
from scenenet.synthetic.returns.clutter import MAKERS
from scenenet.synthetic.returns.conductors import BUNDLE_M, bundled
from scenenet.synthetic.scene.towers import KINDS


def heights(settings, cloud, truth, codes):
    """Height above the ground of the points with these codes."""
    points = cloud.xyz[np.isin(truth, codes)]
    terrain = make_corridor(settings).terrain
    x, y = (points[:, :2] - [settings.easting, settings.northing]).T
    return points[:, 2] - terrain.height(x, y)


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_every_kind_of_tower(bare, kind):
    _, truth, towers = corridor_cloud(bare(kinds={kind: 1.0}))
    assert {tower.type for tower in towers} == {kind}
    assert (truth == TOWER).sum() > 300


@pytest.mark.parametrize("kind", [*sorted(MAKERS), "house"])
def test_every_kind_of_clutter(bare, kind):
    settings = bare(clutter=60.0, clutter_kinds={kind: 1.0}, towers=4)
    cloud, truth, _ = corridor_cloud(settings)
    above = heights(settings, cloud, truth, (LOW, TALL))
    least, most = {"fence": (1.0, 1.8), "house": (2.3, 7.0), "mast": (6.0, 15.0),
                   "street_light": (5.0, 9.0), "dead_tree": (6.0, 20.0),
                   "crane": (22.0, 44.0)}[kind]  # fmt: skip
    assert least < above.max() < most
    assert len(above) > 30


def test_without_clutter_settings_there_is_no_clutter(bare):
    _, truth, _ = corridor_cloud(bare())
    assert set(np.unique(truth).tolist()) <= {*ON_GROUND, TOWER, CONDUCTOR}


def test_trees_bushes_and_hedges(bare):
    tops = {}
    for name, share in (("tree_cover", 0.8), ("bush_cover", 0.8), ("hedges", 1.0)):
        settings = bare(**{name: share}, towers=6)
        cloud, truth, _ = corridor_cloud(settings)
        grown = heights(settings, cloud, truth, (LOW, TREE, TALL))
        tops[name] = np.percentile(grown, 99)
    assert 8 < tops["tree_cover"] < 26
    assert 1.5 < tops["bush_cover"] < 5
    assert 1.5 < tops["hedges"] < 5


def test_water_gives_few_returns_and_its_own_class(bare):
    dry, wet = (corridor_cloud(bare(water=share, towers=8))[1] for share in (0.0, 0.6))
    assert not (dry == WATER).any()
    assert (wet == WATER).sum() > 100
    assert len(wet) < 0.9 * len(dry)


def test_roads_are_bare_and_rails_stand_above_them(bare):
    settings = bare(rails=1.0, towers=12)
    cloud, truth, _ = corridor_cloud(settings)
    above = heights(settings, cloud, truth, ON_GROUND)
    assert np.isclose(above, 0.4, atol=1e-6).sum() > 50, "the bed"
    assert np.isclose(above, 0.57, atol=1e-6).sum() > 5, "the rails"
    meadow = {"low_vegetation": 0.9, "towers": 12}
    bare_share = [
        np.isin(corridor_cloud(bare(**meadow, roads=roads))[1], ON_GROUND).mean()
        for roads in (0.0, 1.0)
    ]
    assert bare_share[1] > 1.05 * bare_share[0]


def test_cables_of_other_lines_are_tall_and_not_main_line(bare):
    settings = bare(other_lines=60.0)
    cloud, truth, _ = corridor_cloud(settings)
    above = heights(settings, cloud, truth, (TALL,))
    assert len(above) > 100
    assert 2.0 < np.median(above) < 12.0


@pytest.mark.parametrize("circuits", [1, 2])
@pytest.mark.parametrize("bundle", [1, 2, 3, 4])
@pytest.mark.parametrize("earth_wires", [0, 1, 2])
def test_conductors_bundles_and_earth_wires(bare, circuits, bundle, earth_wires):
    settings = bare(circuits=circuits, bundle=bundle, earth_wires=earth_wires, towers=2)
    tower = make_corridor(settings).line.support(1)
    assert len(tower.ahead) == 3 * circuits + earth_wires
    cables = bundled(tower.ahead, tower.azimuth, bundle, 3 * circuits)
    assert len(cables) == 3 * circuits * bundle + earth_wires
    gap = np.linalg.norm(cables[:, None] - cables, axis=2) + 9 * np.eye(len(cables))
    if bundle > 1:
        assert gap.min() == pytest.approx(BUNDLE_M)
    else:
        assert gap.min() > 2 * BUNDLE_M
    sparse = corridor_cloud(bare(towers=2))[1]
    dense = corridor_cloud(settings)[1]
    ratio = (dense == CONDUCTOR).sum() / (sparse == CONDUCTOR).sum()
    assert ratio == pytest.approx(len(cables) / 3, rel=0.15)


def test_strays_lie_below_the_helicopter_on_one_side(bare):
    settings = bare(high_strays=0.5, flight_height=(60.0, 60.0), relief=0.0)
    cloud, truth, _ = corridor_cloud(settings)
    above = heights(settings, cloud, truth, (STRAY,))
    assert 45 < np.median(above) < 60
    assert above.max() < 60.1
    corridor = make_corridor(settings)
    strip = corridor.line.strips(1)[0]
    x, y = (cloud.xyz[truth == STRAY, :2] - [settings.easting, settings.northing]).T
    across = strip.to_strip(x, y)[1][strip.holds(x, y)]
    assert np.abs(np.median(across)) > 5


def test_a_second_pass_doubles_the_density_where_it_overlaps(bare):
    one, two = (len(corridor_cloud(bare(swath_overlap=s, towers=8))[0]) for s in (0.0, 0.5))
    assert 1.2 < two / one < 2.0


def test_houses_throw_a_shadow(bare):
    """No pulse reaches the ground behind a wall."""
    scan = {"density": 150.0, "flight_height": (40.0, 40.0), "relief": 0.0}
    houses = bare(clutter=100.0, clutter_kinds={"house": 1.0}, **scan)
    cells = [
        len(np.unique(np.floor(corridor_cloud(settings)[0].xyz[:, :2] * 3), axis=0))
        for settings in (houses, bare(**scan))
    ]
    assert cells[0] < cells[1] - 50
