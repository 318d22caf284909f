"""The ground is one field, the same for all stretches."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.synthetic.scene.random_fields import Raster, hash01, value_noise
from scenenet.synthetic.scene.terrain import Terrain
from scenenet.synthetic.settings import SyntheticSettings

PLACES = np.random.default_rng(5).uniform(-300, 300, (2, 500))


def test_ground_is_the_same_from_any_raster_and_without_one():
    terrain = Terrain(SyntheticSettings(seed=3))
    x, y = np.random.default_rng(1).uniform(40, 60, (2, 300))
    alone = terrain.height(x, y)
    np.testing.assert_array_equal(terrain.raster((0, 0, 60, 60)).bilinear(x, y), alone)
    np.testing.assert_array_equal(terrain.raster((39.7, 40, 200, 90)).bilinear(x, y), alone)


def test_ground_has_no_steps():
    terrain = Terrain(SyntheticSettings(seed=3, relief=120, terraces=0))
    x = np.arange(0, 400, 0.05)
    step = np.abs(np.diff(terrain.height(x, np.full(len(x), 17.3))))
    assert step.max() < 0.05 * np.tan(np.radians(60))


def test_relief_scales_the_hills_and_none_is_flat():
    def heights(**settings):
        return Terrain(SyntheticSettings(seed=2, elevation=100, terraces=0, **settings)).height(
            *PLACES
        )

    assert np.ptp(heights(relief=0)) == 0
    np.testing.assert_allclose(heights(relief=80) - 100, 4 * (heights(relief=20) - 100))


def test_roughness_breaks_the_ground_up():
    def wiggle(roughness):
        terrain = Terrain(SyntheticSettings(seed=2, roughness=roughness, terraces=0))
        z = terrain.height(np.arange(0, 500, 1.0), np.zeros(500))
        return np.abs(np.diff(z, 2)).mean()

    assert wiggle(0.9) > 1.5 * wiggle(0.1)


def test_other_seed_other_hills():
    a, b = (Terrain(SyntheticSettings(seed=seed)).height(*PLACES) for seed in (1, 2))
    assert abs(np.corrcoef(a, b)[0, 1]) < 0.6


def test_noise_stays_between_minus_one_and_one_and_is_centred():
    x, y = np.random.default_rng(0).uniform(-1e6, 1e6, (2, 50_000))
    noise = value_noise(x, y, 7.0, seed=11)
    assert np.abs(noise).max() <= 1
    assert abs(noise.mean()) < 0.02


def test_neighbouring_nodes_are_unrelated():
    i, j = np.meshgrid(np.arange(-200, 200), np.arange(-200, 200))
    draw = hash01(i, j, 4)
    assert abs(draw.mean() - 0.5) < 0.01
    for axis in (0, 1):
        a, b = np.take(draw, range(399), axis), np.take(draw, range(1, 400), axis)
        assert abs(np.corrcoef(a.ravel(), b.ravel())[0, 1]) < 0.02


@pytest.mark.parametrize("step", [0.25, 1.0, 2.0])
def test_raster_reads_a_plane_back(step):
    raster = Raster.covering((-7.3, 2.1, 5.0, 9.9), step)
    x, y = raster.nodes()
    raster.values[:] = 2 * x - 3 * y
    px, py = np.array([-7.3, 0.0, 4.99]), np.array([2.1, 5.5, 9.89])
    np.testing.assert_allclose(raster.bilinear(px, py), 2 * px - 3 * py, atol=1e-9)
    at = raster.nearest(px, py)
    assert np.abs(x.ravel()[at] - px).max() <= step / 2 + 1e-9
    assert np.abs(y.ravel()[at] - py).max() <= step / 2 + 1e-9


def test_terraces_are_level_between_walls():
    slopes = {}
    for share in (0.0, 1.0):
        terrain = Terrain(SyntheticSettings(seed=4, relief=170, terraces=share))
        x = np.arange(0, 600, 1.0)
        slopes[share] = np.abs(np.diff(terrain.height(x, np.zeros(600))))
    assert np.quantile(slopes[1.0], 0.5) < 0.5 * np.quantile(slopes[0.0], 0.5)
    assert slopes[1.0].max() > 1.5 * slopes[0.0].max()
