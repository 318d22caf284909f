"""The explanation of a tower names the measurements there and the reasons to check it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from fixtures.sound_tower import SOUND_TOWER

from scenenet.interpretability.explanations import TowerExplanation, explanations

TOWER = replace(
    SOUND_TOWER, x=1.0, y=2.0, height=21.4, base=104.2, width=1.9,
    conductor_bearings=(251.2, 70.8), points=400,
    contributions={"cylinder": 0.6, "arrow": -0.4},
)  # fmt: skip
ONE_SIDE = {"conductor_directions": 1, "conductor_bearings": (70.8,)}


@pytest.fixture
def explain(pole_finder):
    """A function that explains ``TOWER`` with some of its columns changed."""
    _, card = pole_finder

    def make(*units, **changes) -> TowerExplanation:
        [one] = explanations([replace(TOWER, **changes)], card, *units)
        return one

    return make


def test_the_measurements_are_given_in_words(explain):
    evidence = " ".join(explain().evidence)
    assert "21 m tall" in evidence
    assert "1.9 m wide" in evidence
    assert "71° and 251°" in evidence


def test_the_contributions_come_with_their_sign_and_share(explain):
    (first, share, sentence), (second, _, other) = explain().contributions
    assert (first, share, second) == ("cylinder", 0.6, "arrow")
    assert "supports a tower, 60%" in sentence
    assert "opposes a tower, 40%" in other


def test_a_tower_in_the_middle_of_a_line_raises_no_doubt(explain):
    assert explain().doubts == ()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (ONE_SIDE, "one direction"),
        ({"edge_distance": 9.0}, "may be missing"),
        ({"height": 60.0, "edge_distance": 19.0}, "may be missing"),
        ({"conductor_directions": 0, "conductor_bearings": ()}, "no conductors"),
        ({"points": 100}, "100 points of its own"),
        ({"probability": 0.6}, "below tau"),
        ({"probability": 0.8}, "not far above tau"),
    ],
)
def test_each_doubtful_measurement_is_named(explain, changes, words):
    [doubt] = explain(**changes).doubts
    assert words in doubt


def test_conductors_cut_off_by_the_edge_of_the_data_raise_no_second_doubt(explain):
    one_side = explain(**ONE_SIDE, edge_distance=5.0)
    assert not any("one direction" in doubt for doubt in one_side.doubts)


FOOT = 0.3048
MIXED = ((1.0, 1.0, FOOT), ("metre", "metre", "foot"))
FEET = ((FOOT, FOOT, FOOT), ("US survey foot",) * 3)


def test_lengths_are_named_in_the_units_of_the_survey(explain):
    mixed, feet = explain(*MIXED), explain(*FEET)
    assert (mixed.unit, mixed.vertical_unit) == ("metre", "foot")
    assert "21 ft tall, on ground at 104 ft" in mixed.evidence[0]
    assert "1.9 m wide" in mixed.evidence[1]
    assert "21 US survey ft tall" in feet.evidence[0]
    assert "1.9 US survey ft wide" in feet.evidence[1]
    assert explain().unit == "metre"


def test_units_do_not_change_the_doubts(explain):
    # 9 m from the edge, and crossarms of a tower of 21.4 ft reach at most 2.9 m.
    assert explain(*MIXED, edge_distance=9.0).doubts == ()
    assert explain(*FEET, edge_distance=10.0).doubts == ()
    [doubt] = explain(*FEET, edge_distance=9.0).doubts
    assert "9 US survey ft from the edge" in doubt
    # The edge is 50 ft away, nearer than the 20 m in which conductors must be seen.
    tall = {"height": 10.0, "edge_distance": 50.0}
    assert explain(*FEET, **ONE_SIDE, **tall).doubts == ()
    assert "one direction" in explain(**ONE_SIDE, **tall).doubts[0]
