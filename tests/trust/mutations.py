"""Damaged files against the reader: an answer or an InputError, in bounded time and memory.

Worker processes (``reader``) read the files, because a crash, a hang or an exhausted memory ends a
process.
"""

from __future__ import annotations

import contextlib
import json
import os
import selectors
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from trust.originals import FORMATS
from trust.processes import environment
from trust.table import Attempt, Subject

PER_FORMAT = 2000
READ_SECONDS, COMMAND_SECONDS = 60.0, 120.0
"""Longest time for one file. A decoder that hangs is stopped after 8 s, and a machine may be
busy."""
START_SECONDS = 300.0
COMMAND_EVERY = 20
"""Every so many files go through the command line as well."""
MAX_MEMORY = 2**30
"""Most memory (resident, bytes) of a process that reads a file of a few kB."""


def _try(kind: str, folder: Path, seed: int, numbers: Sequence[int]) -> Iterator[Attempt]:
    worker = None
    try:
        for number in numbers:
            worker = worker or Worker(kind, folder, seed)
            answer = worker.ask(number, number % COMMAND_EVERY == 0)
            yield Attempt(number, answer["what"], answer.get("lost"))
            if "lost" in answer:  # a fresh one, in case it is damaged as well
                worker = worker.close()
    finally:
        if worker is not None:
            worker.close()


class Worker:
    """A process that damages and reads the files of one format."""

    def __init__(
        self, kind: str, folder: Path, seed: int, program: Sequence[str] = ("-m", "trust.reader")
    ) -> None:
        self._errors = folder / "errors.txt"
        with self._errors.open("wb") as errors:
            self._process = subprocess.Popen(
                [sys.executable, *program, kind, str(folder), str(seed)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=errors,
                env=environment(),
                start_new_session=True,
            )
        assert self._process.stdout is not None
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._process.stdout, selectors.EVENT_READ)
        if self._line(START_SECONDS) != b"ready\n":
            raise RuntimeError(f"the reader did not start: {self._said()}")

    def ask(self, number: int, commands: bool) -> dict[str, Any]:
        """What the reader made of a file; ``lost`` where it made nothing good of it."""
        assert self._process.stdin is not None
        limit = COMMAND_SECONDS if commands else READ_SECONDS
        self._process.stdin.write(f"{number} {int(commands)}\n".encode())
        self._process.stdin.flush()
        line = self._line(limit)
        if line:
            return json.loads(line)
        what = f"damaged file {number}"
        if line is None:
            return {"what": what, "lost": f"no answer within {limit:g} s"}
        code = self._process.wait()
        how = f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
        return {"what": what, "lost": f"the reader ended by {how}: {self._said()}"}

    def _line(self, seconds: float) -> bytes | None:
        """The next line; empty if the process ended, None if it is silent."""
        assert self._process.stdout is not None
        if not self._selector.select(seconds):
            return None
        return self._process.stdout.readline()

    def _said(self) -> str:
        return self._errors.read_text(errors="replace")[-500:].strip()

    def close(self) -> None:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)  # its decoder as well
        self._process.wait()
        self._selector.close()
        for stream in (self._process.stdin, self._process.stdout):
            with contextlib.suppress(BrokenPipeError):
                stream.close()


SUBJECTS = [Subject(f"mutations of {kind}", partial(_try, kind), PER_FORMAT) for kind in FORMATS]
