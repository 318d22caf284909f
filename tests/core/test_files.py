"""Outputs are written whole or not at all, and digests depend on content."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from scenenet.core.files import atomic, digest, read_json, sha256, write_json, write_text


def everything_in(folder: Path) -> list[str]:
    return sorted(p.name for p in folder.iterdir())


def test_a_file_does_not_exist_before_it_is_complete(tmp_path):
    target = tmp_path / "new" / "table.csv"
    with atomic(target) as partial:
        partial.write_text("half")
        assert not target.exists()
        partial.write_text("whole")
    assert target.read_text() == "whole"
    assert everything_in(target.parent) == ["table.csv"]


@pytest.mark.parametrize("interruption", [RuntimeError, KeyboardInterrupt])
def test_an_interrupted_write_leaves_the_old_file_and_nothing_else(tmp_path, interruption):
    target = tmp_path / "table.csv"
    target.write_text("old")
    with pytest.raises(interruption), atomic(target) as partial:
        partial.write_text("half of the new")
        raise interruption
    assert target.read_text() == "old"
    assert everything_in(tmp_path) == ["table.csv"]


def test_the_temporary_name_keeps_the_suffix(tmp_path):
    with atomic(tmp_path / "survey.laz") as partial:
        assert partial.suffix == ".laz"
        assert partial.parent.parent == tmp_path  # the same disk, or the rename would be a copy
        partial.touch()


def test_a_folder_is_replaced_as_a_whole(tmp_path):
    target = tmp_path / "report"
    for name in ("old.html", "new.html"):
        with atomic(target) as partial:
            partial.mkdir()
            (partial / name).touch()
    assert everything_in(target) == ["new.html"]
    assert everything_in(tmp_path) == ["report"]


def test_nan_is_refused_in_json_and_the_old_file_stays(tmp_path):
    target = tmp_path / "scores.json"
    write_json(target, {"f05": 0.5})
    with pytest.raises(ValueError, match="JSON"):
        write_json(target, {"f05": float("nan")})
    assert read_json(target) == {"f05": 0.5}


def test_text_is_written_as_utf_8(tmp_path):
    write_text(tmp_path / "name.txt", "Évora → Setúbal\n")
    assert (tmp_path / "name.txt").read_bytes().decode("utf-8") == "Évora → Setúbal\n"


def test_sha256_matches_a_known_digest(tmp_path):
    (tmp_path / "abc").write_bytes(b"abc")
    known = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    assert sha256(tmp_path / "abc") == known


def test_digest_depends_on_content_and_not_on_the_order_of_keys():
    settings = {"epochs": 50, "loss": {"alpha": 5.0, "epsilon": 0.1}}
    reordered = json.loads('{"loss": {"epsilon": 0.1, "alpha": 5.0}, "epochs": 50}')
    assert digest(settings) == digest(reordered)
    assert digest(settings) != digest(settings | {"epochs": 51})
    assert digest(["a", "b"]) != digest(["b", "a"])
