"""Whether a file is still the one that an earlier pass read.

A survey is read several times: for its towers, its crops, its voxels, its points. If another
program replaces it in between, the passes do not fit together.
"""

from __future__ import annotations

import contextlib
import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scenenet.core.errors import InputError
from scenenet.core.provenance import SAMPLE_SUFFIXES

ENDS_BYTES = 64 * 1024
"""Bytes at the start and at the end of a file that are compared: its header and its tables."""


@dataclass(frozen=True)
class FileState:
    """What identifies the content of a file, or of a folder of samples, without reading all of it.

    Attributes:
        path: the file or the folder.
        identity: of each file, by name, that counts (``SAMPLE_SUFFIXES`` in a folder): its number
            on its disk, size, time of the last change (ns), and digest of its start and end. The
            disk itself does not count: the nodes of a cluster number a shared one differently.
    """

    path: Path
    identity: Mapping[str, tuple[int, int, int, str]]

    @classmethod
    def of(cls, path: str | Path) -> FileState:
        """The present state of a file or folder.

        Raises:
            InputError: a file cannot be read.
        """
        path = Path(path)
        files = [path]
        if path.is_dir():
            files = sorted(f for f in path.iterdir() if f.suffix.lower() in SAMPLE_SUFFIXES)
        return cls(path, {file.name: _identity(file) for file in files})

    def to_json(self) -> dict[str, Any]:
        return {"path": str(self.path), "identity": {n: list(i) for n, i in self.identity.items()}}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> FileState:
        """The state that ``to_json`` gave."""
        found = {n: (i[0], i[1], i[2], i[3]) for n, i in data["identity"].items()}
        return cls(Path(data["path"]), found)

    def check(self) -> None:
        """Check that the file or folder has not changed since.

        Raises:
            InputError: it has, or it is missing now.
        """
        try:
            now = FileState.of(self.path).identity
        except InputError as error:
            raise _changed(error.file or self.path) from None
        for name in sorted(now.keys() | self.identity.keys()):
            if now.get(name) != self.identity.get(name):
                raise _changed(self.path / name if self.path.is_dir() else self.path)


def _identity(path: Path) -> tuple[int, int, int, str]:
    try:
        with path.open("rb") as stream:
            digest = hashlib.sha256(stream.read(ENDS_BYTES))
            stream.seek(max(0, path.stat().st_size - ENDS_BYTES))
            digest.update(stream.read(ENDS_BYTES))
        status = path.stat()
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", file=path) from None
    return status.st_ino, status.st_size, status.st_mtime_ns, digest.hexdigest()


def _changed(path: str | Path) -> InputError:
    return InputError(
        "the file was changed, replaced or removed while it was used, so nothing was written",
        file=path,
        remedy="Run the command again when no program writes to the file",
    )


@contextlib.contextmanager
def unchanged(*files: str | Path | FileState) -> Iterator[None]:
    """Make sure that files, or folders of samples, stay the same within the block, or since the
    state given.

    If one has changed, this replaces any other error in the block, which comes from it. A path that
    does not exist is not looked at.

    Raises:
        InputError: one of the files has changed, or a sample was added to a folder.
    """
    states = [
        file if isinstance(file, FileState) else FileState.of(file)
        for file in files
        if isinstance(file, FileState) or Path(file).exists()
    ]
    try:
        yield
    except Exception:
        for state in states:
            state.check()
        raise
    for state in states:
        state.check()
