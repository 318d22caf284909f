"""A bundle of two wires, in free air and in a crown."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fixtures.true_line import span_of, wire_of

from scenenet.clearance.distance import nearest_on
from scenenet.clearance.find_clearances import find_clearances
from scenenet.clearance.section import SectionPoints
from scenenet.clearance.settings import ClearanceSettings
from scenenet.line.catenary import Catenary
from scenenet.line.records import SurveyLine
from scenenet.pointcloud.class_schemes import ASPRS

CURVE = Catenary((0.0, 0.0, 30.0), (200.0, 0.0, 30.0), 1500.0)
OFFSETS = ((0.2, 0.0), (-0.2, 0.0))
WIRE = replace(wire_of(CURVE, 1, 1), tube=0.6, offsets=OFFSETS, subconductors=2, rmse=0.03)
LINE = SurveyLine((span_of(1, 1, [np.array([0.0, 0.0]), np.array([200.0, 0.0])]),), (WIRE,), ())
VEGETATION, WIRE_CODE, UNCLASSIFIED = 5, 14, 1


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(3)


def own_points(rng: np.random.Generator) -> np.ndarray:
    """Points (n, 3) m of the two wires, and of spacers between them."""
    parts = []
    for left, above in OFFSETS:
        s = np.arange(0.0, 200.0, 0.4)
        t, z = rng.normal((left, above), 0.03, (len(s), 2)).T
        parts.append(np.column_stack((s, t, CURVE.height(s) + z)))
    s = np.repeat(np.arange(25.0, 200.0, 50.0), 9)
    parts.append(np.column_stack((s, np.tile(np.linspace(-0.2, 0.2, 9), 4), CURVE.height(s))))
    return np.concatenate(parts)


def crown(rng: np.random.Generator, middle: tuple[float, float, float]) -> np.ndarray:
    """Points (n, 3) m of a crown of 3 m, evenly spread, and of its stem."""
    offset = rng.uniform(-3, 3, (4000, 3))
    leaves = np.array(middle) + offset[np.linalg.norm(offset, axis=1) <= 3]
    x, y, z = middle
    return np.concatenate((leaves, [(x, y, up) for up in np.arange(0.0, z - 3.0, 0.5)]))


def nearest_vegetation(codes: bool, *parts: tuple[np.ndarray, int]) -> float | None:
    """m from the conductor, over level ground; None if there is none."""
    ground = np.random.default_rng(1).uniform((-30, -60, 0), (230, 60, 0.05), (20_000, 3))
    parts = (*parts, (ground, 2))
    xyz = np.concatenate([points for points, _ in parts])
    code = np.concatenate([np.full(len(points), number, np.uint8) for points, number in parts])

    def points(area):
        inside = area.has(xyz)
        return SectionPoints(xyz[inside], code[inside])

    scheme = ASPRS if codes else None
    found = find_clearances(LINE, points, ClearanceSettings(voltage=66), scheme)
    own = [place.distance for place in found.places if place.kind == "vegetation"]
    return min(own, default=None)


@pytest.mark.parametrize("code", [None, VEGETATION, UNCLASSIFIED])
def test_leaves_between_the_wires_of_a_bundle_are_vegetation(rng, code):
    leaves = crown(rng, (100.0, 0.5, float(CURVE.height(np.array([100.0]))[0]) - 1.0))
    parts = (leaves, code or VEGETATION), (own_points(rng), WIRE_CODE)
    found = nearest_vegetation(code is not None, *parts)
    assert found is not None
    # Some leaves are on the wires themselves.
    assert 0 <= found - nearest_on(CURVE, leaves).distance.min() < 0.1


def test_a_bundle_and_its_spacers_in_free_air_are_no_vegetation(rng):
    assert nearest_vegetation(False, (own_points(rng), WIRE_CODE)) is None


def test_a_crown_that_ends_below_the_bundle_does_not_make_its_spacers_vegetation(rng):
    leaves = crown(rng, (125.0, 0.0, float(CURVE.height(np.array([125.0]))[0]) - 4.5))
    parts = (leaves, VEGETATION), (own_points(rng), WIRE_CODE)
    found = nearest_vegetation(False, *parts)
    assert found == pytest.approx(nearest_on(CURVE, leaves).distance.min(), abs=1e-6)


def test_points_with_the_class_of_wires_are_none_in_a_crown(rng):
    leaves = crown(rng, (125.0, 0.0, float(CURVE.height(np.array([125.0]))[0]) - 2.0))
    leaves = leaves[nearest_on(CURVE, leaves).distance > 0.9]
    parts = (leaves, VEGETATION), (own_points(rng), WIRE_CODE)
    found = nearest_vegetation(True, *parts)
    assert found == pytest.approx(nearest_on(CURVE, leaves).distance.min(), abs=1e-6)
