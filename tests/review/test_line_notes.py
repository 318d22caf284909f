"""What the line says of towers, in a review file."""

from __future__ import annotations

import shutil

import pyproj
import pytest
from fixtures.review_files import rows_of

from scenenet.line.notes import EXPECTED, UNHELD, UNTRACED, LineNote
from scenenet.line.records import SurveyLine
from scenenet.prediction.line_lists import write_line_layers

METRES = (1.0, 1.0, 1.0)


@pytest.fixture
def with_a_line(found, towers, tmp_path):
    """The prediction, with the notes of a line: one tower is held by no conductor, one more is
    expected, and so is a span between two others."""
    copy = tmp_path / "found"
    shutil.copytree(found, copy)
    last = towers[-1]
    place = float(last["x"]) + 30.0, float(last["y"])
    one, other, idle = (int(towers[n]["id"]) for n in (0, 1, 4))
    notes = (
        LineNote(*place, EXPECTED, 0, 7),
        LineNote(0.0, 0.0, UNHELD, idle, 0),
        LineNote(*place, UNTRACED, one, 7, other),
    )
    line = SurveyLine((), (), notes)
    write_line_layers(copy / "line.gpkg", line, pyproj.CRS(32629), METRES)
    return copy, place


@pytest.mark.parametrize("ending", ["csv", "gpkg"])
def test_a_review_file_asks_for_what_the_line_says(with_a_line, towers, tmp_path, ending, call):
    found, place = with_a_line
    path = tmp_path / f"review.{ending}"
    assert call("review", found, "--template", path).code == 0
    if ending == "gpkg":
        decided = call("review", found, "--decisions", path, "--json")
        assert decided.code == 0
        return
    expected, gap, *others = rows_of(path)
    assert (expected["id"], expected["decision"]) == ("", "")
    assert "a tower is expected" in expected["doubts"]
    assert (float(expected["x"]), float(expected["y"])) == pytest.approx(place)
    between = {towers[0]["id"], towers[1]["id"]}
    assert gap["id"] == "" and all(number in gap["doubts"] for number in between)
    assert {row["id"] for row in others if "no span was traced" in row["doubts"]} == between
    doubted = [row["id"] for row in others if "no conductor that was traced" in row["doubts"]]
    assert doubted == [towers[4]["id"]]
    assert len(others) == len(towers)


def test_an_unfilled_review_file_decides_nothing_and_a_filled_one_adds_a_tower(
    with_a_line, towers, tmp_path, call
):
    found, _ = with_a_line
    path = tmp_path / "review.csv"
    assert call("review", found, "--template", path).code == 0
    assert call("review", found, "--decisions", path).code == 0
    path.write_text(path.read_text().replace("\n,", "\n,add", 1))
    assert call("review", found, "--decisions", path, "--overwrite").code == 0
    reviewed = rows_of(found / "line.reviewed.csv")
    assert [row["decision"] for row in reviewed].count("added") == 1
    assert len(reviewed) == len(towers) + 1
