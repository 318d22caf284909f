"""The record of what a command wrote, so that the next call replaces nothing else."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scenenet.core.errors import InputError
from scenenet.core.files import atomic, read_json, write_json
from scenenet.core.outputs import Output
from scenenet.core.provenance import fingerprint

OUTPUTS = "outputs"
"""Key of the record with the fingerprint of each file, by its path."""


@dataclass(frozen=True)
class RecordedFiles:
    """Files that are written together, with a record of their content.

    Attributes:
        record: JSON file with the result as plain values, and ``OUTPUTS``.
        files: the others.
    """

    record: Path
    files: Sequence[Path]

    def outputs(self) -> list[Output]:
        """All of them, for ``check_outputs``."""
        return [Output(path, self.is_own) for path in (*self.files, self.record)]

    def is_own(self, path: Path) -> bool:
        """Whether a file is as an earlier call wrote it."""
        try:
            if path == self.record:
                return isinstance(read_json(path)[OUTPUTS], dict)
            return self._known().get(self._key(path)) == fingerprint(path)
        except (InputError, KeyError, OSError, TypeError, ValueError):
            return False

    def _known(self) -> dict[str, str]:
        """The fingerprints in the record; none if there is no record of this kind."""
        try:
            known = read_json(self.record)[OUTPUTS]
        except (KeyError, OSError, TypeError, ValueError):
            return {}
        return known if isinstance(known, dict) else {}

    def _key(self, path: Path) -> str:
        """Name of a file in the record: its path from the folder of the record."""
        return Path(os.path.relpath(path, self.record.parent)).as_posix()

    @contextmanager
    def writing(self, result: Mapping[str, Any]) -> Iterator[dict[Path, Path]]:
        """Temporary paths of the files, which all appear when the block ends, or none.

        Args:
            result: of the command, for the record.

        Raises:
            OutputError: a file cannot be written.
        """
        with ExitStack() as stack:
            partial = {path: stack.enter_context(atomic(path)) for path in self.files}
            record = stack.enter_context(atomic(self.record))
            yield partial
            prints = {self._key(path): fingerprint(written) for path, written in partial.items()}
            # What an earlier call wrote and this one does not stays known as its own.
            write_json(record, {**result, OUTPUTS: {**self._known(), **prints}})
