"""The error for users names the place, the problem and the remedy."""

from __future__ import annotations

import errno
import pickle

import pytest

from scenenet.core.errors import InputError, in_file, output_error, warn


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ({}, "it is empty"),
        ({"file": "a.laz"}, "a.laz: it is empty"),
        ({"place": "row 3"}, "row 3: it is empty"),
        ({"remedy": "Fill it"}, "it is empty. Fill it"),
        (
            {"file": "a.laz", "place": "row 3", "remedy": "Fill it"},
            "a.laz: row 3: it is empty. Fill it",
        ),
    ],
)
def test_the_message_has_the_parts_that_are_known(parts, message):
    assert str(InputError("it is empty", **parts)) == message


def test_a_question_needs_no_full_stop():
    assert str(InputError("did you mean 'b'?", remedy="Name one")) == "did you mean 'b'? Name one"


def test_an_error_can_be_sent_between_processes():
    error = InputError("it is empty", file="a.laz", place="row 3", remedy="Fill it")
    copy = pickle.loads(pickle.dumps(error))
    assert str(copy) == str(error)
    assert (copy.file, copy.place, copy.remedy) == ("a.laz", "row 3", "Fill it")


def test_a_file_and_a_place_are_added_where_they_are_missing():
    with pytest.raises(InputError) as caught, in_file("a.laz"), in_file(place="crop 1"):
        raise InputError("too far out", remedy="Remove it")
    assert str(caught.value) == "a.laz: crop 1: too far out. Remove it"
    with pytest.raises(InputError) as caught, in_file("a.laz", "crop 1"):
        raise InputError("too far out", file="b.laz", place="row 2")
    assert str(caught.value) == "b.laz: row 2: too far out"


def test_warnings_name_their_file_on_stderr(capsys):
    warn("a.laz", ["odd", "very odd"])
    assert capsys.readouterr() == ("", "warning: a.laz: odd\nwarning: a.laz: very odd\n")


def test_an_error_without_a_file_may_come_from_another_disk(tmp_path, monkeypatch):
    reason = OSError(errno.ENOSPC, "No space left on device")
    monkeypatch.setattr("scenenet.core.errors.free_space", lambda path: 1000)
    small = str(output_error(tmp_path / "a.laz", reason))
    assert small.endswith("the disk is full (0.0 MB are free). Free space, or choose another disk")
    monkeypatch.setattr("scenenet.core.errors.free_space", lambda path: 10**12)
    large = str(output_error(tmp_path / "a.laz", reason))
    assert "or another disk is full" in large
    assert "NUMBA_CACHE_DIR" in large
