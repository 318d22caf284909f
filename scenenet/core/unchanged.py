"""Whether a file is still the one that an earlier pass read.

A survey is read several times: for its towers, its crops, its voxels, its points. If another
program replaces it in between, the passes do not fit together.
"""

from __future__ import annotations

import contextlib
import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from scenenet.core.errors import InputError

ENDS_BYTES = 64 * 1024
"""Bytes at the start and at the end of a file that are compared: its header and its tables."""


@dataclass(frozen=True)
class FileState:
    """What identifies the content of a file without reading all of it.

    Attributes:
        path: the file.
        identity: device and number of the file there, size, time of the last change (ns), and
            digest of its start and end.
    """

    path: Path
    identity: tuple[int, int, int, int, str]

    @classmethod
    def of(cls, path: str | Path) -> FileState:
        """The present state of a file.

        Raises:
            InputError: the file cannot be read.
        """
        path = Path(path)
        try:
            with path.open("rb") as stream:
                digest = hashlib.sha256(stream.read(ENDS_BYTES))
                stream.seek(max(0, path.stat().st_size - ENDS_BYTES))
                digest.update(stream.read(ENDS_BYTES))
            status = path.stat()
        except OSError as error:
            raise InputError(f"cannot be read ({error.strerror})", file=path) from None
        content = (status.st_size, status.st_mtime_ns, digest.hexdigest())
        return cls(path, (status.st_dev, status.st_ino, *content))

    def check(self) -> None:
        """Check that the file has not changed since.

        Raises:
            InputError: it has, or it is missing now.
        """
        with contextlib.suppress(InputError):
            if FileState.of(self.path) == self:
                return
        raise InputError(
            "the file was changed, replaced or removed while it was used, so nothing was written",
            file=self.path,
            remedy="Run the command again when no program writes to the file",
        )


@contextlib.contextmanager
def unchanged(*files: str | Path | FileState) -> Iterator[None]:
    """Make sure that files stay the same within the block, or since the state given.

    Folders are not looked at.

    If one has changed, this replaces any other error in the block, which comes from it.

    Raises:
        InputError: one of the files has changed.
    """
    states = [file for file in files if isinstance(file, FileState)]
    paths = [Path(file) for file in files if not isinstance(file, FileState)]
    states += [FileState.of(path) for path in paths if path.is_file()]
    try:
        yield
    except Exception:
        for state in states:
            state.check()
        raise
    for state in states:
        state.check()
