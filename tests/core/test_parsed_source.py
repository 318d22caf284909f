"""What a file of Python contains is remembered between processes, and never out of date."""

from __future__ import annotations

import ast
import json

import pytest

from scenenet.core import parsed_source
from scenenet.core.parsed_source import Import, SourceCache

SOURCE = "from .near import reach as far\nimport json\n\n\ndef f():\n    return far\n"


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "stage.py"
    path.write_text(SOURCE)
    return path


@pytest.fixture
def path(tmp_path):
    return tmp_path / "cache.json"


@pytest.fixture
def kept(file, path):
    """What the first process finds; it leaves the file of the cache."""
    cache = SourceCache(path)
    found = cache.read(file)
    cache.save()
    return found


@pytest.fixture
def without_parser(kept, monkeypatch):
    def refuse(*arguments, **options):
        raise AssertionError("the file is parsed again")

    monkeypatch.setattr(ast, "parse", refuse)


def test_the_imports_of_a_file(kept):
    assert kept.imports == (Import("far", 1, "near", "reach"), Import("json", 0, "json", None))
    assert not kept.only_imports


def test_the_next_process_parses_nothing(kept, file, path, without_parser):
    assert SourceCache(path).read(file) == kept


def test_the_place_and_the_date_of_a_file_do_not_count(kept, file, path, without_parser):
    moved = file.rename(file.with_name("moved.py"))
    moved.touch()
    assert SourceCache(path).read(moved) == kept


def test_an_edited_file_is_parsed_even_with_the_same_date(kept, file, path):
    file.write_text(SOURCE.replace("return far", "return fur"))
    assert SourceCache(path).read(file).digest != kept.digest


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\xff",
        b"[]",
        b"{}",
        b'{"made_by": "another version", "sources": {}}',
        b'{"made_by": "MADE_BY", "sources": []}',
        b'{"made_by": "MADE_BY", "sources": {"a": 1}}',
        b'{"made_by": "MADE_BY", "sources": {"a": ["d", [["x"]], true]}}',
    ],
)
def test_a_damaged_cache_is_ignored_and_written_again(kept, file, path, content):
    path.write_bytes(content.replace(b"MADE_BY", SourceCache(None).made_by.encode()))
    cache = SourceCache(path)
    assert cache.read(file) == kept
    cache.save()
    assert kept in SourceCache(path).known.values()


def test_what_another_version_of_the_parser_found_is_not_used(kept, file, path):
    written = json.loads(path.read_text())
    assert written["made_by"] == SourceCache(None).made_by
    (key,) = written["sources"]
    written["sources"][key][0] = "another digest"
    path.write_text(json.dumps(written))
    assert SourceCache(path).read(file).digest == "another digest"
    path.write_text(json.dumps(written | {"made_by": "another version"}))
    assert SourceCache(path).read(file) == kept


def test_a_cache_that_cannot_be_written_is_no_error(kept, file, tmp_path):
    cache = SourceCache(tmp_path / "stage.py" / "cache.json")  # in a file
    assert cache.read(file) == kept
    cache.save()
    assert list(tmp_path.glob(".*")) == []


def test_what_was_used_the_longest_ago_goes_first(file, path, monkeypatch):
    monkeypatch.setattr(parsed_source, "MOST_REMEMBERED", 2)
    cache = SourceCache(path)
    found = []
    for number in range(3):
        file.write_text(f"x = {number}\n")
        found.append(cache.read(file).digest)
    file.write_text("x = 1\n")
    cache.read(file)
    cache.save()
    assert [one.digest for one in SourceCache(path).known.values()] == [found[2], found[1]]
