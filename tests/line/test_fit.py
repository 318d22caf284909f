"""A catenary through points."""

from __future__ import annotations

import numpy as np
import pytest
from fixtures.line_scene import NOISE_M, points_on

from scenenet.line.catenary import Catenary
from scenenet.line.fit import Prior, fit_catenary


def wire(c: float, length: float = 300.0, blowout: float = 0.0) -> Catenary:
    return Catenary((0.0, 1.0, 30.0), (length, -2.0, 38.0), c, blowout)


@pytest.mark.parametrize("c", [250.0, 900.0, 2400.0])
@pytest.mark.parametrize("outliers", [0.0, 0.2])
@pytest.mark.parametrize("rise", [8.0, 110.0])
def test_sag_is_found_to_centimetres_among_outliers(c, outliers, rise):
    rng = np.random.default_rng(1)
    true = Catenary((0.0, 1.0, 30.0), (300.0, -2.0, 30.0 + rise), c)
    points = points_on(true, 0.8, rng)
    leaves = rng.random(len(points)) < outliers
    points[leaves, 2] -= rng.uniform(0.4, 3.0, leaves.sum())
    fit = fit_catenary(points, np.ones(len(points)))
    ends, _ = fit.catenary.along(np.array([true.start, true.end]))
    assert fit.catenary.between(*ends).sag == pytest.approx(true.sag, abs=0.04)
    assert fit.rmse == pytest.approx(np.sqrt(2) * NOISE_M, rel=0.25)  # to two sides
    assert not fit.weights[leaves].any()


def test_a_wire_in_the_wind_is_followed():
    points = points_on(wire(1200.0, blowout=0.7), 1.0, np.random.default_rng(2))
    fit = fit_catenary(points, np.ones(len(points)))
    assert fit.catenary.blowout == pytest.approx(0.7, abs=0.03)
    assert fit.rmse < 0.05


def test_a_prior_decides_where_points_do_not():
    rng = np.random.default_rng(3)
    short = points_on(wire(700.0).between(0.0, 12.0), 1.0, rng)
    long = points_on(wire(700.0), 1.0, rng)
    prior = Prior(1 / 1500, 0.1 / 1500)
    on_short = fit_catenary(short, np.ones(len(short)), prior)
    on_long = fit_catenary(long, np.ones(len(long)), prior)
    assert on_short.catenary.parameter == pytest.approx(1500, rel=0.15)
    assert on_long.catenary.parameter == pytest.approx(700, rel=0.05)


def test_three_points_are_no_wire():
    assert fit_catenary(np.array([[0.0, 0, 9], [5, 0, 8], [9, 0, 9]]), np.ones(3)) is None
