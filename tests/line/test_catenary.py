"""The curve of a wire."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.line.catenary import Catenary

SHARES = np.linspace(0, 1, 101)


@pytest.mark.parametrize("rise", [-20.0, 0.0, 35.0])
@pytest.mark.parametrize("blowout", [0.0, -1.5])
def test_a_wire_ends_at_its_attachments_and_hangs_below_the_chord(rise, blowout):
    start, end = np.array([5.0, 5.0, 40.0]), np.array([95.0, 125.0, 40.0 + rise])
    wire = Catenary.of(start, end, 1000.0, blowout)
    places = wire.at_shares(SHARES)
    np.testing.assert_allclose(places[[0, -1]], [start, end], atol=1e-9)
    below = (start + SHARES[:, None] * (end - start) - places)[:, 2]
    assert (below[1:-1] > 0).all()
    assert wire.sag == pytest.approx(below.max(), abs=1e-3)
    assert wire.sag == pytest.approx(150**2 / (8 * 1000), rel=0.05)
    if not blowout:
        pieces = np.linalg.norm(np.diff(places, axis=0), axis=1)
        assert wire.arc_length == pytest.approx(pieces.sum(), rel=1e-4)


def test_points_of_a_wire_have_no_residual_and_others_have_their_distance():
    blown = Catenary((0.0, 0.0, 30.0), (200.0, 0.0, 45.0), 800.0, blowout=0.8)
    s = np.linspace(5, 195, 40)
    np.testing.assert_allclose(blown.residuals(blown.at(s)), 0, atol=1e-9)
    left, _ = blown.residuals(blown.at(s) + np.array([0.0, 0.3, 0.0]))
    np.testing.assert_allclose(left, 0.3, atol=1e-9)
    wire = Catenary(blown.start, blown.end, blown.parameter)
    normal = np.column_stack((-wire.slope(s), np.zeros(40), np.ones(40)))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    _, above = wire.residuals(wire.at(s) + 0.2 * normal)
    np.testing.assert_allclose(above, 0.2, atol=1e-3)


def test_a_part_of_a_wire_is_the_same_curve():
    wire = Catenary((0.0, 0.0, 30.0), (60.0, 80.0, 20.0), 500.0, blowout=0.5)
    part = wire.between(20.0, 80.0)
    np.testing.assert_allclose(part.residuals(wire.at(np.linspace(20, 80, 30))), 0, atol=0.01)
    assert part.parameter == wire.parameter
