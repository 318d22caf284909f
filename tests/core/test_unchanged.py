"""A file that changes between two passes is noticed, and one that does not is not."""

from __future__ import annotations

import os
import shutil

import pytest

from scenenet.core.errors import InputError
from scenenet.core.unchanged import ENDS_BYTES, FileState, unchanged


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "survey.las"
    path.write_bytes(bytes(5 * ENDS_BYTES))
    return path


def keep_time(path, write) -> None:
    """Change a file as ``cp -p`` and ``rsync -a`` do: the time of the last change stays."""
    before = path.stat()
    write()
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))


def test_a_file_that_stays_is_unchanged(file):
    state = FileState.of(file)
    file.read_bytes()
    with unchanged(file, state, file.parent):
        pass
    state.check()


@pytest.mark.parametrize("at", [0, ENDS_BYTES - 1, 5 * ENDS_BYTES - 1])
def test_other_bytes_of_header_and_tables_are_noticed_even_with_the_old_time(file, at):
    state, data = FileState.of(file), bytearray(file.read_bytes())
    data[at] = 1
    keep_time(file, lambda: file.write_bytes(data))
    with pytest.raises(InputError, match="changed, replaced or removed"):
        state.check()


def test_another_file_of_the_same_content_and_time_is_noticed(file):
    state, other = FileState.of(file), file.with_name("other.las")
    other.write_bytes(file.read_bytes())
    keep_time(file, lambda: other.replace(file))
    with pytest.raises(InputError, match=r"survey\.las"):
        state.check()


def test_a_file_that_grew_or_is_missing_is_noticed(file):
    for change in (lambda: file.open("ab").write(b"more"), file.unlink):
        state = FileState.of(file)
        change()
        with pytest.raises(InputError, match="Run the command again"):
            state.check()
    with pytest.raises(InputError, match="cannot be read"):
        FileState.of(file)


def test_an_error_that_comes_from_the_change_is_replaced_and_any_other_is_not(file):
    with pytest.raises(KeyError), unchanged(file):
        raise KeyError
    with pytest.raises(InputError, match="changed"), unchanged(file):
        file.write_bytes(b"another")
        raise IndexError


@pytest.fixture
def folder(tmp_path):
    for name in ("a.npy", "b.npy", "notes.txt"):
        (tmp_path / name).write_bytes(b"content")
    return tmp_path


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (lambda folder: (folder / "b.npy").write_bytes(b"another"), "b.npy"),
        (lambda folder: (folder / "a.npy").unlink(), "a.npy"),
        (lambda folder: (folder / "c.pt").write_bytes(b"new"), "c.pt"),
    ],
    ids=["changed", "removed", "added"],
)
def test_a_sample_that_changes_in_a_folder_is_named(folder, change, named):
    with pytest.raises(InputError, match=named), unchanged(folder):
        change(folder)


def test_other_files_in_a_folder_of_samples_may_change(folder):
    with unchanged(folder):
        (folder / "notes.txt").write_bytes(b"other notes")
        (folder / "model.json").touch()


def test_a_folder_that_is_missing_is_named(folder):
    with pytest.raises(InputError, match="changed, replaced or removed"), unchanged(folder):
        shutil.rmtree(folder)
