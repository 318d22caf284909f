"""The error for users names the place, the problem and the remedy."""

from __future__ import annotations

import pickle

import pytest

from scenenet.core.errors import InputError


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


def test_an_error_can_be_sent_between_processes():
    error = InputError("it is empty", file="a.laz", place="row 3", remedy="Fill it")
    copy = pickle.loads(pickle.dumps(error))
    assert str(copy) == str(error)
    assert (copy.file, copy.place, copy.remedy) == ("a.laz", "row 3", "Fill it")
