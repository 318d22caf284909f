"""Progress is written to stderr and does not change the items."""

from __future__ import annotations

import pytest

from scenenet.core import progress
from scenenet.core.progress import quiet, track


def test_items_pass_through_and_a_log_gets_a_last_line(capsys):
    assert list(track(iter("abc"), "letters")) == ["a", "b", "c"]
    out, err = capsys.readouterr()
    assert out == ""
    assert err == "letters: done (3)\n"


def test_a_log_gets_a_line_at_each_interval(capsys, monkeypatch):
    monkeypatch.setattr(progress, "LOG_INTERVAL_S", 0.0)
    list(track([1, 2], "crops"))
    lines = capsys.readouterr().err.splitlines()
    assert lines == ["crops: 1/2, about 1 s left", "crops: 2/2", "crops: done (2)"]
    list(track(iter("ab"), "letters"))
    assert capsys.readouterr().err.splitlines()[0] == "letters: 1"


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.2, "1 s"), (119, "119 s"), (150, "2 min"), (7300, "2 h")]
)
def test_the_time_left_is_told_in_a_unit_that_suits_it(seconds, text):
    assert progress._duration(seconds) == text


def test_a_step_of_other_work_reports_no_progress(capsys):
    for _ in track("ab", "crops"):
        with quiet():
            assert list(track([1, 2], "tiles")) == [1, 2]
    assert capsys.readouterr().err == "crops: done (2)\n"


def test_an_empty_iterable_yields_nothing():
    assert list(track([], "crops")) == []
