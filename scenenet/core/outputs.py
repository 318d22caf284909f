"""What a command may write: looked at before any work, so that nothing of the user is lost."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from scenenet.core.errors import OutputError, free_space


@dataclass(frozen=True)
class Output:
    """A file that a command is about to write.

    Attributes:
        path: the file.
        is_own: whether a file that exists there is an earlier output of the same command, unchanged
            since.
        source: the input that it is made from; None where it is made from all of them.
    """

    path: Path
    is_own: Callable[[Path], bool]
    source: Path | None = None


def check_outputs(
    outputs: Iterable[Output], inputs: Iterable[Path], *, overwrite: bool = False
) -> None:
    """Refuse outputs that would destroy something.

    A file that exists is replaced only if ``is_own`` accepts it, or with ``overwrite``. An input is
    never replaced, and two outputs never share a path.

    Raises:
        OutputError: names the first output that is refused.
    """
    planned: dict[Path, Output] = {}
    named = list(inputs)
    for output in outputs:
        path = output.path
        _check_folder(path)
        place = path.resolve()
        if place in planned:
            raise OutputError(
                f"{_of(output)} and {_of(planned[place])} would both be written to this file",
                file=path,
                remedy="Use a different folder or name for each of them",
            )
        planned[place] = output
        for name in named:
            if place == name.resolve() or _same_file(path, name):
                raise OutputError(
                    "this file is an input and would be replaced by the result",
                    file=path,
                    remedy="Choose another --out",
                )
        if path.is_dir():
            raise OutputError(
                "a folder of this name exists", file=path, remedy="Choose another name"
            )
        if not overwrite and os.path.lexists(path) and not output.is_own(path):
            raise OutputError(
                "this file exists, and is not an unchanged result of the same command",
                file=path,
                remedy="Choose another --out, or replace it with --overwrite",
            )


def check_space(needs: Mapping[Path, int]) -> None:
    """Refuse work for which the disks have too little space.

    Args:
        needs: path -> bytes that will be written there. Needs on one disk are added up.

    Raises:
        OutputError: names the path, what is needed and what is free.
    """
    by_disk: dict[int, list[tuple[Path, int]]] = {}
    for path, size in needs.items():
        existing = next(p for p in (path.absolute(), *path.absolute().parents) if p.exists())
        by_disk.setdefault(existing.stat().st_dev, []).append((path, size))
    for shares in by_disk.values():
        needed, free = sum(size for _, size in shares), free_space(shares[0][0])
        if needed > free:
            paths = " and ".join(str(path) for path, _ in shares)
            raise OutputError(
                f"about {needed / 1e6:,.1f} MB are needed, and {free / 1e6:,.1f} MB are free",
                file=paths,
                remedy="Free space, or choose another disk with --out (results) and TMPDIR "
                "(temporary files)",
            )


def _check_folder(path: Path) -> None:
    for folder in path.absolute().parents:
        if not folder.exists():
            if folder.is_symlink():
                raise OutputError(
                    "this folder is a link to a place that does not exist", file=folder
                )
            continue
        if not folder.is_dir():
            raise OutputError(
                "this is a file, not a folder for results",
                file=folder,
                remedy="Choose another --out",
            )
        if not os.access(folder, os.W_OK | os.X_OK):
            raise OutputError(
                "this folder cannot be written to",
                file=folder,
                remedy="Change its permissions, or choose another --out",
            )
        return


def _same_file(one: Path, other: Path) -> bool:
    try:
        return one.samefile(other)
    except OSError:
        return False


def _of(output: Output) -> str:
    return "a result" if output.source is None else f"the result of {output.source}"
