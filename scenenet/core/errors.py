"""The errors and warnings that users of the package see: what is wrong, where, and what to do."""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Self


class InputError(ValueError):
    """The input is at fault (a file, a table, a setting), not the program.

    The message always reads ``FILE: PLACE: PROBLEM. REMEDY``, without the parts that are unknown,
    so that one line of a log is enough to act on. The command line turns it into exit code 1.

    Args:
        problem: what is wrong, as a sentence without a full stop.
        file: the file at fault.
        place: where in the file (a row, a byte, a key), if known.
        remedy: what the user can do, as a sentence without a full stop.
    """

    def __init__(
        self,
        problem: str,
        *,
        file: str | Path | None = None,
        place: str | None = None,
        remedy: str | None = None,
    ) -> None:
        self.problem = problem
        self.file = None if file is None else str(file)
        self.place = place
        self.remedy = remedy
        where = "".join(f"{part}: " for part in (self.file, place) if part)
        stop = "" if problem.endswith("?") else "."
        super().__init__(where + problem + (f"{stop} {remedy}" if remedy else ""))

    def to_json(self) -> dict[str, str | None]:
        """Its parts, for a file that a later stage reads."""
        return {n: getattr(self, n) for n in ("problem", "file", "place", "remedy")}

    @classmethod
    def from_json(cls, parts: Mapping[str, str | None]) -> Self:
        """The error with the parts that ``to_json`` gave."""
        given = {name: parts[name] for name in ("file", "place", "remedy")}
        return cls(parts["problem"] or "", **given)

    def __reduce__(self):  # keyword-only arguments do not survive the default pickling
        return _rebuild, (type(self), self.problem, self.file, self.place, self.remedy)


class OutputError(InputError):
    """A result cannot be written where it should go; arguments as ``InputError``."""


def _rebuild(
    kind: type[InputError], problem: str, file: str | None, place: str | None, remedy: str | None
) -> InputError:
    return kind(problem, file=file, place=place, remedy=remedy)


@contextlib.contextmanager
def in_file(file: str | Path | None = None, place: str | None = None) -> Iterator[None]:
    """Name the file and the place in an ``InputError`` of the block that does not name them: code
    that works on points does not know where they come from."""
    try:
        yield
    except InputError as error:
        raise type(error)(
            error.problem,
            file=error.file or file,
            place=error.place or place,
            remedy=error.remedy,
        ) from error


def warn(file: str | Path, warnings: Iterable[str]) -> None:
    """Print what looks wrong about a file on stderr, a line each."""
    for warning in warnings:
        print(f"warning: {file}: {warning}", file=sys.stderr)


ENOUGH_BYTES = 1 << 26
"""With more free bytes than this, an error that names no file may come from another disk."""

_STORAGE = {
    errno.ENOSPC: ("the disk is full", "Free space, or choose another disk"),
    errno.EDQUOT: ("the disk quota is used up", "Free space, or choose another disk"),
    errno.EFBIG: ("the file would exceed the limit on file sizes", "Raise the limit (ulimit -f)"),
    errno.EROFS: ("the file system is read-only", "Choose another folder"),
    errno.EACCES: ("writing is not permitted", "Change the permissions, or choose another folder"),
    errno.EPERM: ("writing is not permitted", "Change the permissions, or choose another folder"),
    errno.ENOTDIR: ("a part of its path is a file, not a folder", "Choose another folder"),
    errno.EEXIST: ("a part of its path is a file, not a folder", "Choose another folder"),
    errno.EISDIR: ("a folder of this name exists", "Choose another name"),
    errno.ENAMETOOLONG: ("its name is too long", "Choose a shorter name"),
    errno.ENOENT: ("its folder was removed", "Run it again"),
    errno.EIO: ("the disk reports an input or output error", "Check the disk"),
}


def output_error(path: str | Path, reason: OSError, what: str = "the file") -> OutputError | None:
    """The message for an error of the storage under ``path``; None for other errors."""
    if reason.errno not in _STORAGE:
        return None
    path = Path(path)
    if path.parent.name.startswith(f".{path.name}."):  # the temporary name of a result
        path = path.parent.parent / path.name
    problem, remedy = _STORAGE[reason.errno]
    if reason.errno in (errno.ENOSPC, errno.EDQUOT):
        free = free_space(path)
        problem += f" ({free / 1e6:,.1f} MB are free)"
        if reason.filename is None and free > ENOUGH_BYTES:
            problem += ", after the incomplete files were removed, or another disk is full"
            remedy += ". Other disks are those of TMPDIR and NUMBA_CACHE_DIR (compiled code)"
    return OutputError(f"{what} cannot be written: {problem}", file=path, remedy=remedy)


@contextlib.contextmanager
def storage_errors(path: Path, scratch: str, what: str = "the file") -> Iterator[None]:
    """Turn errors of the storage under ``path`` that the block raises into an OutputError.

    Errors about other paths pass unchanged.

    Args:
        path: the result, or the folder of temporary files.
        scratch: how the absolute paths of the block's temporary files begin.
        what: the subject of the message.
    """
    try:
        yield
    except OSError as error:
        if error.filename is not None:
            about = str(Path(os.fsdecode(error.filename)).absolute())
            above = {str(folder) for folder in (path.absolute(), *path.absolute().parents)}
            if about not in above and not about.startswith(scratch):
                raise
        message = output_error(path, error, what)
        if message is None:
            raise
        raise message from error


def free_space(path: str | Path) -> int:
    """Free bytes on the disk of ``path``, which need not exist yet."""
    path = Path(path).absolute()
    existing = next(folder for folder in (path, *path.parents) if folder.exists())
    return shutil.disk_usage(existing).free
