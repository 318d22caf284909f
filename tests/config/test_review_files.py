"""Review files belong to the survey that their name begins with."""

from __future__ import annotations

import pytest

from scenenet.config.review_files import find_reviews
from scenenet.config.schema import load

SETTINGS = {"models": [{"name": "scenenet", "kind": "scenenet"}], "seeds": [0]}


@pytest.fixture
def reviews(tmp_path):
    def write(*names: str):
        (tmp_path / "reviews").mkdir(exist_ok=True)
        for name in names:
            (tmp_path / "reviews" / name).write_text("id,decision\n")
        warnings: list[str] = []
        found = find_reviews(load(SETTINGS), ["line", "line.north"], tmp_path, warnings.append)
        return found, warnings

    return write


def test_the_longest_name_that_fits_owns_a_file(reviews):
    found, warnings = reviews("line.csv", "line.anna.gpkg", "line.north.csv", "line.north.b.CSV")
    assert found == {
        "line": ["reviews/line.anna.gpkg", "reviews/line.csv"],
        "line.north": ["reviews/line.north.b.CSV", "reviews/line.north.csv"],
    }
    assert not warnings


def test_a_file_of_no_survey_is_named_and_others_are_skipped(reviews):
    found, warnings = reviews("lines.csv", ".line.csv", "line.txt", "line.gpkg-wal")
    assert not found
    [text] = warnings
    assert text.startswith("left out: reviews/lines.csv: ") and "line, line.north" in text


def test_without_the_folder_there_are_none(tmp_path):
    assert find_reviews(load(SETTINGS), ["line"], tmp_path, pytest.fail) == {}
    off = load({**SETTINGS, "new_surveys": {"reviews": None}})
    assert find_reviews(off, ["line"], tmp_path, pytest.fail) == {}
