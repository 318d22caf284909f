"""Scratch folders that go with their process, or at the next start where it was killed."""

from __future__ import annotations

import contextlib
import fcntl
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from scenenet.core.errors import OutputError, storage_errors

PREFIX = "scenenet-"
"""Of the names of all folders in the temporary directory."""

_LOCK = ".lock"
_RANDOM_CHARACTERS = 8
"""Characters that ``tempfile.mkdtemp`` adds to the prefix."""


def temporary_directory() -> Path:
    """The directory for scratch folders.

    Raises:
        OutputError: ``TMPDIR`` names no directory, or there is none that can be written to. Python
            alone would silently take another one, perhaps on a disk that is too small.
    """
    named = os.environ.get("TMPDIR")
    if named and not Path(named).is_dir():
        raise OutputError(
            "TMPDIR names this directory for temporary files, but it does not exist",
            file=named,
            remedy="Create it, or set TMPDIR to a directory that exists",
        )
    try:
        return Path(tempfile.gettempdir())
    except FileNotFoundError:
        raise OutputError(
            "there is no directory for temporary files",
            remedy="Set TMPDIR to a directory that you may write to",
        ) from None


@contextlib.contextmanager
def scratch_folder() -> Iterator[Path]:
    """A new folder in the temporary directory; it is removed at the end of the block.

    Folders of processes that were killed are removed first.

    Raises:
        OutputError: the folder cannot be made, its disk is full, or it was removed meanwhile.
    """
    root = temporary_directory()
    ours = f"{root.absolute()}{os.sep}{PREFIX}"
    with storage_errors(root, ours, "temporary files"), _locked_folder(root, PREFIX) as folder:
        content = folder / "files"  # without the lock
        content.mkdir()
        yield content


@contextlib.contextmanager
def scratch_beside(path: Path) -> Iterator[Path]:
    """A new folder beside ``path``, so that a file in it can be renamed to ``path``.

    Folders for the same ``path`` whose process was killed are removed first.
    """
    with _locked_folder(path.parent, f".{path.name}.") as folder:
        yield folder


def scratch_prefix(path: Path) -> str:
    """How the absolute paths of the folders of ``scratch_beside`` begin."""
    return f"{path.parent.absolute()}{os.sep}.{path.name}."


@contextlib.contextmanager
def _locked_folder(parent: Path, prefix: str) -> Iterator[Path]:
    _sweep(parent, prefix)
    folder = Path(tempfile.mkdtemp(prefix=prefix, dir=parent))
    try:
        with _lock(folder):
            yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@contextlib.contextmanager
def _lock(folder: Path) -> Iterator[None]:
    """Hold a lock in ``folder``. The system releases it when the process ends, however it ends.

    The lock is taken before its file gets its name: a sweep never finds a free lock of a live
    process.
    """
    unnamed = folder / f"{_LOCK}.new"
    with unnamed.open("wb") as stream:
        with contextlib.suppress(OSError):  # a file system without locks: no sweep will remove it
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
            unnamed.replace(folder / _LOCK)
        yield


def _sweep(parent: Path, prefix: str) -> None:
    """Remove the folders of processes that no longer run."""
    length = len(prefix) + _RANDOM_CHARACTERS
    with contextlib.suppress(OSError):
        for entry in list(os.scandir(parent)):
            if not (entry.name.startswith(prefix) and len(entry.name) == length):
                continue
            with contextlib.suppress(OSError), Path(entry.path, _LOCK).open("rb") as stream:
                fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)  # fails while its process runs
                shutil.rmtree(entry.path, ignore_errors=True)
