"""Decompression in a separate process: a crash ends only that process, and the error names the
file."""

from __future__ import annotations

import contextlib
import importlib.util
import json
import os
import selectors
import signal
import subprocess
import sys
import tempfile
from base64 import b64encode
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from scenenet.core.errors import InputError
from scenenet.pointcloud.las import decoder
from scenenet.pointcloud.las.header import CheckedHeader

STALL_SECONDS = float(os.environ.get("SCENENET_STALL_SECONDS", "8"))
"""Seconds without a decoded point after which the decoder counts as hung, if it has worked for half
of them. Points arrive in pieces of a few hundred thousand, each within a fraction of a second."""
PATIENCE = 8
"""So many times these seconds are given to a decoder that does not get to work: other programs have
the processor, or the disk is slow. A disk that needs more: set SCENENET_STALL_SECONDS."""
MAX_BYTES = 4 * 2**30
"""Address space that the decoder may use. An intact file needs some hundred MB."""
PIECE_POINTS = 200_000
"""Points decoded and sent at once: enough to keep two cores busy with chunks of 50 000."""
REMEDY = (
    "Get the file again from its source; if it is damaged there too, rewrite it with another "
    "tool (pdal translate, las2las, laszip)"
)


def _job(
    header: CheckedHeader, chunk_points: int, places_only: bool, stall_seconds: float
) -> dict[str, Any]:
    las = header.las
    return {
        "path": str(header.path.resolve()),
        "library": _library(),
        "record": b64encode(las.vlrs.get("LasZipVlr")[0].record_data).decode(),
        "offset": las.offset_to_point_data,
        "points": las.point_count,
        "size": las.point_format.size,
        "by_return": int(las.number_of_points_by_return.sum()),
        "places_only": places_only,
        "chunk": chunk_points,
        "piece": PIECE_POINTS,
        "watchdog_s": max(1, int((PATIENCE + 1) * stall_seconds)),
        "max_bytes": MAX_BYTES,
    }


def _command(job: dict) -> list[str]:
    # The file, not the module: importing the package would take a second. Without -S, the start
    # files of an environment take as long as the rest of the start. -I keeps the folder of the file
    # off the import path.
    return [sys.executable, "-I", "-S", str(Path(decoder.__file__)), json.dumps(job)]


@cache
def _library() -> str:
    """The folder from which the worker imports lazrs; empty where it is missing."""
    found = importlib.util.find_spec("lazrs")
    if found is None or found.origin is None:
        return ""
    file = Path(found.origin)
    return str(file.parents[1] if found.submodule_search_locations else file.parent)


def decompress(
    header: CheckedHeader,
    chunk_points: int,
    *,
    places_only: bool = False,
    stall_seconds: float | None = None,
    command: Sequence[str] | None = None,
) -> Iterator[np.ndarray]:
    """Decompress the points of a LAZ file in another process.

    Args:
        header: its checked header.
        chunk_points: points in each array except the last.
        places_only: only coordinates, class and flags are needed, which is faster; other fields
            may be 0.
        stall_seconds: time without data after which the process is stopped.
        command: command to run instead of the worker.

    Yields:
        (n,) structured arrays of point records as laspy has them, all of the header's points.

    Raises:
        InputError: the decoder refused the file, crashed, hung, or ended early.
    """
    stall = STALL_SECONDS if stall_seconds is None else stall_seconds
    if command is None:
        command = _command(_job(header, chunk_points, places_only, stall))
    environment = os.environ | {
        "RUST_BACKTRACE": "0",
        "RAYON_NUM_THREADS": os.environ.get("RAYON_NUM_THREADS", str(min(os.cpu_count() or 1, 4))),
        "OPENBLAS_NUM_THREADS": "1",  # unused threads of numpy would take memory
        "MALLOC_ARENA_MAX": "4",
    }
    with tempfile.TemporaryFile() as errors:
        worker = subprocess.Popen(
            list(command), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=errors,
            env=environment,
        )  # fmt: skip
        try:
            with contextlib.closing(_Pipe(worker, header, stall, errors)) as pipe:
                yield from _chunks(pipe, header, chunk_points)
        finally:
            worker.kill()
            worker.wait()


def _chunks(pipe: _Pipe, header: CheckedHeader, chunk_points: int) -> Iterator[np.ndarray]:
    total, dtype = header.las.point_count, header.las.point_format.dtype()
    done, filled = 0, 0
    while done < total:
        size = min(chunk_points, total - done)
        n = pipe.announced(b"P", done + filled)
        if not 0 < n <= size - filled:
            raise pipe.nonsense(done + filled)
        if filled == 0:  # only after the decoder sent points of the length that the header claims
            chunk = np.empty(size, dtype)
        pipe.fill(chunk[filled : filled + n], done + filled)
        filled += n
        if filled == size:
            yield chunk
            done, filled = done + size, 0
    pipe.announced(b"D", done)


def _count(done: int, header: CheckedHeader) -> str:
    return f"{done} of {header.las.point_count} points"


class _Pipe:
    """The output of the worker, read with a time limit between data."""

    def __init__(
        self, worker: subprocess.Popen, header: CheckedHeader, stall: float, errors
    ) -> None:
        assert worker.stdout is not None
        self._worker, self._header, self._stall, self._errors = worker, header, stall, errors
        self._out = worker.stdout
        self._fd = self._out.fileno()
        self._worked = 0.0
        """Seconds that the worker had worked when its last data came."""
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._fd, selectors.EVENT_READ)

    def close(self) -> None:
        self._selector.close()
        self._out.close()

    def announced(self, kind: bytes, done: int) -> int:
        """The number of the next frame, which must be of this kind."""
        got, n = b"W", 0
        while got == b"W":
            got, n = decoder.FRAME.unpack(self._read(decoder.FRAME.size, done))
        if got == b"C":
            text = self._read(min(n, 10_000), done).decode(errors="replace")
            raise InputError(text, file=self._header.path, remedy=REMEDY)
        if got == b"E":
            text = self._read(min(n, 10_000), done).decode(errors="replace")
            raise InputError(
                "the compressed points cannot be decoded after "
                f"{_count(done, self._header)} ({text})",
                file=self._header.path,
                remedy=REMEDY,
            )
        if got != kind:
            raise self.nonsense(done)
        return n

    def nonsense(self, done: int) -> InputError:
        return InputError(
            f"the decoder sent something other than points after {_count(done, self._header)}",
            file=self._header.path,
            remedy=REMEDY,
        )

    def fill(self, records: np.ndarray, done: int) -> None:
        self._fill(records.view(np.uint8).data, done)

    def _read(self, n: int, done: int) -> bytearray:
        data = bytearray(n)
        self._fill(memoryview(data), done)
        return data

    def _fill(self, view: memoryview, done: int) -> None:
        at = 0
        while at < len(view):
            self._wait(done)
            got = os.readv(self._fd, [view[at:]])
            if got == 0:
                raise self._ended(done)
            at += got

    def _wait(self, done: int) -> None:
        """Wait for data, or until the worker counts as hung."""
        waited = 0.0
        while waited < PATIENCE * self._stall:
            if self._selector.select(self._stall):
                self._worked = _seconds_of_work(self._worker.pid)
                return
            waited += self._stall
            if _seconds_of_work(self._worker.pid) - self._worked >= self._stall / 2:
                break
        raise InputError(
            f"the decoder hung: it sent no point for {waited:g} s after "
            f"{_count(done, self._header)}",
            file=self._header.path,
            remedy=REMEDY + ", or set SCENENET_STALL_SECONDS higher for a slow disk",
        )

    def _ended(self, done: int) -> InputError:
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._worker.wait(timeout=self._stall)
        code = self._worker.poll()
        self._errors.seek(0)
        lines = self._errors.read().decode(errors="replace").strip().splitlines()
        output = f" ({lines[-1][:300]})" if lines else ""
        if code is not None and code < 0:
            how = f"was ended by signal {signal.Signals(-code).name}"
        else:
            how = f"ended with exit code {code}"
        return InputError(
            f"the decoder {how} after {_count(done, self._header)}{output}: the compressed points "
            f"are damaged, or need more than {MAX_BYTES // 2**30} GiB of memory",
            file=self._header.path,
            remedy=REMEDY,
        )


def _seconds_of_work(pid: int) -> float:
    """Processor time of a process so far, s; infinite where the system does not say (Linux does)
    or the process has ended."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return float("inf")
    return (int(state[11]) + int(state[12])) / os.sysconf("SC_CLK_TCK")
