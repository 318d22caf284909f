"""Decompression in a process of its own: what it breaks is that process, and the error names the
file."""

from __future__ import annotations

import contextlib
import json
import os
import selectors
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from scenenet.errors import InputError
from scenenet.pointcloud import decoder
from scenenet.pointcloud.header import LasHeader

STALL_SECONDS = float(os.environ.get("SCENENET_STALL_SECONDS", "8"))
"""Seconds without a single decoded point after which a file counts as one that hangs. Points come
in pieces of a few hundred thousand, each a fraction of a second; a slow network disk may need
more: set SCENENET_STALL_SECONDS."""
MAX_BYTES = 4 * 2**30
"""Address space that the decoder may ask for. An honest file needs some hundred MB."""
PIECE_POINTS = 200_000
"""Points decoded and handed over at once: enough to keep two cores busy with chunks of 50 000."""
CLASS_BYTE_LEGACY, CLASS_BYTE = 15, 16
"""Byte of the class code in a point record of formats 0-5, and of 6-10."""
REMEDY = (
    "Get the file again from where it came from; if it is the same there, rewrite it with another "
    "tool (pdal translate, las2las, laszip)"
)


def class_byte(header: LasHeader) -> int:
    return CLASS_BYTE_LEGACY if header.point_format < 6 else CLASS_BYTE


def _job(header: LasHeader, whole_records: bool, stall_seconds: float) -> dict:
    compression = header.compression
    if compression is None:
        raise ValueError(f"{header.path} is not compressed")
    chunk = compression.chunk_size
    piece = PIECE_POINTS
    if compression.is_chunked and 0 < chunk <= PIECE_POINTS:
        piece = PIECE_POINTS // chunk * chunk  # whole chunks, so that none is cut and kept
    return {
        "path": str(header.path.resolve()),
        "offset": header.offset_to_points,
        "record_length": header.record_length,
        "class_byte": class_byte(header),
        "n_points": header.n_points,
        "piece": piece,
        "laszip": compression.record.hex(),
        "chunked": compression.is_chunked,
        "variable_chunks": chunk in (0, 0xFFFFFFFF),
        "chunk_size": chunk,
        "whole_records": whole_records,
        "watchdog_s": max(1, int(decoder.WATCHDOG_FACTOR * stall_seconds)),
        "max_bytes": MAX_BYTES,
    }


def _command(job: dict) -> list[str]:
    # The file and not the module: the package and what it imports would cost a second. -P keeps
    # the folder of the file off the import path.
    return [sys.executable, "-P", str(Path(decoder.__file__)), json.dumps(job)]


def decompress(
    header: LasHeader,
    *,
    whole_records: bool,
    stall_seconds: float | None = None,
    command: Sequence[str] | None = None,
) -> Iterator[np.ndarray | tuple[np.ndarray, np.ndarray]]:
    """Decompress the points of a LAZ file in another process.

    Args:
        header: its checked header.
        whole_records: yield (n, record_length) uint8 records; else ((3, n) int32 X, Y, Z and
            (n,) uint8 class bytes), which is faster.
        stall_seconds: time without a sign of life after which the process is stopped.
        command: what to start in place of the worker.

    Yields:
        pieces in the order of the file, ``header.n_points`` points in all.

    Raises:
        InputError: the decoder refused the file, crashed, hung, or ended early.
    """
    stall = STALL_SECONDS if stall_seconds is None else stall_seconds
    command = _command(_job(header, whole_records, stall)) if command is None else list(command)
    environment = os.environ | {
        "RUST_BACKTRACE": "0",
        "RAYON_NUM_THREADS": os.environ.get("RAYON_NUM_THREADS", str(min(os.cpu_count() or 1, 4))),
        "OPENBLAS_NUM_THREADS": "1",  # each thread that numpy never uses here would take memory
        "MALLOC_ARENA_MAX": "4",
    }
    with tempfile.TemporaryFile() as errors:
        worker = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=errors,
            env=environment,
        )  # fmt: skip
        try:
            with contextlib.closing(_Pipe(worker, header, stall, errors)) as pipe:
                yield from _pieces(pipe, header, whole_records)
        finally:
            worker.kill()
            worker.wait()


def _pieces(pipe: _Pipe, header: LasHeader, whole_records: bool) -> Iterator:
    done = 0
    while True:
        kind, n = decoder.FRAME.unpack(pipe.read(decoder.FRAME.size, done))
        if kind == b"P" and 0 < n <= header.n_points - done:
            if whole_records:
                records = np.empty((n, header.record_length), np.uint8)
                pipe.fill(records, done)
                yield records
            else:
                integers, codes = np.empty((3, n), "<i4"), np.empty(n, np.uint8)
                pipe.fill(integers, done)
                pipe.fill(codes, done)
                yield integers, codes
            done += n
        elif kind == b"E":
            raise _refusal(header, bytes(pipe.read(n, done)).decode(errors="replace"), done)
        elif kind == b"D" and done == header.n_points:
            return
        else:
            raise InputError(
                f"the decoder sent something that is not points after {_count(done, header)}",
                file=header.path,
                remedy=REMEDY,
            )


def _count(done: int, header: LasHeader) -> str:
    return f"{done} of {header.n_points} points"


def _refusal(header: LasHeader, text: str, done: int) -> InputError:
    return InputError(
        f"its compressed points cannot be decoded after {_count(done, header)} ({text})",
        file=header.path,
        remedy=REMEDY,
    )


class _Pipe:
    """The worker's answers, read with a limit on how long nothing may come."""

    def __init__(self, worker: subprocess.Popen, header: LasHeader, stall: float, errors) -> None:
        assert worker.stdout is not None
        self._worker, self._header, self._stall, self._errors = worker, header, stall, errors
        self._out = worker.stdout
        self._fd = self._out.fileno()
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._fd, selectors.EVENT_READ)

    def close(self) -> None:
        self._selector.close()
        self._out.close()

    def read(self, n: int, done: int) -> bytearray:
        data = bytearray(n)
        self._fill(memoryview(data), done)
        return data

    def fill(self, array: np.ndarray, done: int) -> None:
        self._fill(array.data.cast("B"), done)

    def _fill(self, view: memoryview, done: int) -> None:
        at = 0
        while at < len(view):
            if not self._selector.select(self._stall):
                raise InputError(
                    f"the decoder hung: no point for {self._stall:g} s after "
                    f"{_count(done, self._header)}",
                    file=self._header.path,
                    remedy=REMEDY + ", or allow more time on a slow disk (SCENENET_STALL_SECONDS)",
                )
            got = os.readv(self._fd, [view[at:]])
            if got == 0:
                raise self._ended(done)
            at += got

    def _ended(self, done: int) -> InputError:
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._worker.wait(timeout=self._stall)
        code = self._worker.poll()
        self._errors.seek(0)
        lines = self._errors.read().decode(errors="replace").strip().splitlines()
        said = f" ({lines[-1][:300]})" if lines else ""
        if code is not None and code < 0:
            how = f"was ended by signal {signal.Signals(-code).name}"
        else:
            how = f"ended with exit code {code}"
        return InputError(
            f"the decoder {how} after {_count(done, self._header)}{said}: the compressed points "
            f"are damaged, or ask for more than {MAX_BYTES // 2**30} GiB of memory",
            file=self._header.path,
            remedy=REMEDY,
        )
