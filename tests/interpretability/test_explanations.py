"""The receipt of a tower says what was measured there and what should make a person look again."""

from __future__ import annotations

import pytest

from scenenet.interpretability.explanations import Receipt, receipts


@pytest.fixture
def receipt(pole_finder):
    """A function that gives the receipt of a tower with some facts changed."""
    facts = {
        "id": 1, "height": 21.4, "base_elevation": 104.2, "width": 1.9, "probability": 0.99,
        "wire_directions": 2, "wire_bearings": [251.2, 70.8], "points": 400,
        "edge_distance": 50.0, "contributions": {"cylinder": 0.6, "arrow": -0.4},
    }  # fmt: skip

    def make(**changes) -> Receipt:
        point = {"type": "Point", "coordinates": [1.0, 2.0]}
        feature = {"geometry": point, "properties": facts | changes}
        [one] = receipts({"features": [feature]}, *pole_finder)
        return one

    return make


def test_what_stands_there_is_said_in_words(receipt):
    said = " ".join(receipt().evidence)
    assert "21 m tall" in said
    assert "2 m wide" in said
    assert "71° and 251°" in said


def test_a_tower_in_the_midst_of_a_line_raises_no_doubt(receipt):
    assert receipt().doubts == ()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"wire_directions": 1, "wire_bearings": [70.8]}, "one direction"),
        ({"edge_distance": 12.0}, "may be cut off"),
        ({"probability": 0.6}, "under tau"),
        ({"probability": 0.8}, "not far above tau"),
    ],
)
def test_what_is_doubtful_is_said(receipt, changes, words):
    [doubt] = receipt(**changes).doubts
    assert words in doubt


def test_wires_that_the_data_end_under_are_no_doubt_of_their_own(receipt):
    one_side = receipt(wire_directions=1, wire_bearings=[70.8], edge_distance=5.0)
    assert not any("one direction" in doubt for doubt in one_side.doubts)
