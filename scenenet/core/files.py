"""Outputs that are written whole or not at all, JSON files, and digests."""

from __future__ import annotations

import contextlib
import hashlib
import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from scenenet.core.errors import storage_errors
from scenenet.core.scratch import scratch_beside, scratch_prefix


@contextlib.contextmanager
def atomic(path: str | Path) -> Iterator[Path]:
    """A temporary path that is renamed to ``path`` when the block ends without an error.

    A reader never sees half a file, and Ctrl-C leaves neither the file nor the temporary one. What
    a killed process leaves is removed when ``path`` is written next. The temporary path is in the
    same folder and keeps the suffix, because libraries choose a format by it. Works for files and
    for directories (an existing directory is replaced).

    Raises:
        OutputError: the disk is full, the folder cannot be written to, or similar.
    """
    path = Path(path)
    with storage_errors(path, scratch_prefix(path)):
        path.parent.mkdir(parents=True, exist_ok=True)
        with scratch_beside(path) as scratch:
            partial = scratch / path.name
            yield partial
            if partial.is_dir() and path.is_dir():
                shutil.rmtree(path)
            partial.replace(path)


def write_text(path: str | Path, text: str) -> None:
    """Write ``text`` as UTF-8, whole or not at all."""
    with atomic(path) as partial:
        partial.write_text(text, encoding="utf-8")


def write_json(path: str | Path, data: Any) -> None:
    """Write ``data`` as indented JSON; NaN raises a ValueError, because JSON has none."""
    # Piece by piece: a whole text takes five times its size in memory while it is put together.
    with atomic(path) as partial, partial.open("w", encoding="utf-8") as stream:
        json.dump(data, stream, indent=2, allow_nan=False)
        stream.write("\n")


def read_json(path: str | Path) -> Any:
    """The content of a JSON file."""
    return json.loads(Path(path).read_text(encoding="utf-8"))


def sha256(path: str | Path) -> str:
    """Hex digest of a file's content."""
    with Path(path).open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def digest(data: Any) -> str:
    """A short, stable digest of plain data; the order of dictionary keys does not matter."""
    canonical = json.dumps(data, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(canonical.encode()).hexdigest()[:16]
