"""A file of many arrays of records, each found by a number: what stages hand on to one another.

Blocks are appended one after another, and an index at the end says where each one is. A survey with
points far apart has a thousand tiles of a point each, which a file for each would make slow.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping, Set
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from scenenet.core.errors import InputError

_MAGIC = b"scenenet blocks 1\n"
_ENTRY = np.dtype([("code", "<i8"), ("kind", "<i4"), ("offset", "<i8"), ("size", "<i8")])


class BlockWriter:
    """Writes blocks to an open file."""

    def __init__(self, stream: BinaryIO, kinds: Iterable[str]) -> None:
        """Start an empty file.

        Args:
            stream: new file, open for binary writing.
            kinds: names of the kinds of blocks.
        """
        self._stream, self._kinds = stream, tuple(kinds)
        self._entries: list[tuple[int, int, int, int]] = []
        self._offset = stream.write(_MAGIC)

    def add(self, kind: str, code: int, records: np.ndarray) -> None:
        """Append ``records`` to the block of a kind and a number."""
        size = self._stream.write(records.tobytes())
        self._entries.append((code, self._kinds.index(kind), self._offset, size))
        self._offset += size

    def end(self, facts: Mapping[str, Any]) -> None:
        """Write the index, and ``facts`` as JSON. Without this the file is not a file of blocks."""
        head = json.dumps({"kinds": self._kinds, "facts": facts}).encode()
        index = np.array(self._entries, _ENTRY).tobytes()
        sizes = np.array([len(head), len(index)], "<i8").tobytes()
        self._stream.write(head + index + sizes + _MAGIC)


class BlockFile:
    """A file that ``BlockWriter`` wrote. Its blocks are read when they are asked for.

    Attributes:
        path: the file.
        facts: what was written with it.
    """

    def __init__(self, path: str | Path) -> None:
        """Read the index.

        Raises:
            InputError: the file cannot be read, or is not a whole file of blocks.
        """
        self.path = Path(path)
        self._blocks: dict[str, np.ndarray] = {}
        try:
            with self.path.open("rb") as stream:
                end = 16 + len(_MAGIC)
                size = stream.seek(0, os.SEEK_END)
                stream.seek(max(0, size - end))
                tail = stream.read()
                if not tail.endswith(_MAGIC) or len(tail) < end:
                    raise self._damaged()
                head, index = np.frombuffer(tail[:16], "<i8").tolist()
                stream.seek(size - end - index - head)
                known = json.loads(stream.read(head))
                entries = np.frombuffer(stream.read(index), _ENTRY)
        except OSError as error:
            raise InputError(error.strerror or "cannot be read", file=path) from None
        self.facts: dict[str, Any] = known["facts"]
        for number, kind in enumerate(known["kinds"]):
            own = entries[entries["kind"] == number]
            # In the order in which they were written, where a number has several.
            self._blocks[kind] = own[np.argsort(own["code"], kind="stable")]

    @property
    def kinds(self) -> Set[str]:
        """The names of the kinds of blocks."""
        return self._blocks.keys()

    def codes(self, kind: str) -> Iterable[int]:
        """The numbers of the blocks of a kind."""
        return np.unique(self._blocks[kind]["code"]).tolist()

    def read(self, kind: str, code: int, dtype: np.dtype) -> np.ndarray:
        """(n,) records of the block of a kind and a number; none where there is no such block."""
        blocks = self._blocks[kind]
        first, last = np.searchsorted(blocks["code"], [code, code + 1]).tolist()
        if first == last:
            return np.empty(0, dtype)
        parts = []
        # No open file is kept: a survey has thousands of these, and processes may share this one.
        with self.path.open("rb", buffering=0) as stream:
            for _, _, offset, size in blocks[first:last].tolist():
                data = os.pread(stream.fileno(), size, offset)
                if len(data) != size:
                    raise self._damaged()
                parts.append(data)
        return np.frombuffer(parts[0] if len(parts) == 1 else b"".join(parts), dtype)

    def _damaged(self) -> InputError:
        return InputError(
            "the file is damaged, or was not written to its end",
            file=self.path,
            remedy="Remove it, and run the command again",
        )
