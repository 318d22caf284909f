"""The worker that decompresses LAZ points with laspy, in a separate process.

A damaged file can make a LAZ decoder loop forever, panic, abort its process or allocate all memory.
This then ends the worker alone: the parent (``isolation``) detects it and names the file.

It is started with one argument, a JSON object (see ``isolation._job``), and writes frames to
stdout: a kind (one byte), a number (4 bytes), and the data.

- ``P`` n: n whole point records.
- ``E`` n: n bytes of text: the error of the decoder.
- ``D`` 0: all points were sent.

It imports nothing of the package, so that it starts fast.
"""

from __future__ import annotations

import json
import os
import resource
import signal
import struct
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

if TYPE_CHECKING:
    import laspy

FRAME = struct.Struct("<cI")
WATCHDOG_FACTOR = 3
"""The parent stops a worker that stalls. If the parent has ended, the worker's own alarm does so a
little later. It is a signal with its default action, so it works inside a decoder that never
returns to Python."""
SLOW_IMPORTS = ("pyproj", "requests")
"""Optional imports of laspy that the worker does not need; they take half of its start-up time."""


def open_points(job: Mapping[str, Any]) -> laspy.LasReader:
    """laspy's reader of the points of ``job``."""
    import laspy

    fields = laspy.DecompressionSelection.all()
    if job["places_only"]:  # layered files store each field separately, so the others are skipped
        fields = laspy.DecompressionSelection.base().decompress_z().decompress_classification()
    return laspy.open(job["path"], read_evlrs=False, decompression_selection=fields)


def limit_memory(max_bytes: int) -> None:
    """Limit this process to ``max_bytes`` more address space than it has now (Linux only)."""
    statm = Path("/proc/self/statm")
    if not statm.exists():
        return
    limit = int(statm.read_text().split()[0]) * resource.getpagesize() + max_bytes
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    if hard != resource.RLIM_INFINITY:
        limit = min(limit, hard)
    resource.setrlimit(resource.RLIMIT_AS, (limit, hard))


def send_points(job: Mapping[str, Any], out: BinaryIO) -> None:
    """Decompress in pieces and send each piece at once.

    No piece crosses the border of two chunks of ``job["chunk"]`` points.
    """
    import numpy as np

    signal.alarm(job["watchdog_s"])
    with open_points(job) as reader:
        total = reader.header.point_count
        done = 0
        while done < total:
            n = min(job["piece"], job["chunk"] - done % job["chunk"], total - done)
            signal.alarm(job["watchdog_s"])
            points = reader.read_points(n)
            signal.alarm(0)  # the parent may process a piece for any time
            if len(points) != n:
                raise ValueError(f"{len(points)} points instead of {n}")
            out.write(FRAME.pack(b"P", n))
            out.write(np.frombuffer(points.array, np.uint8).data)
            out.flush()
            done += n
    out.write(FRAME.pack(b"D", 0))
    out.flush()


def main() -> int:
    job = json.loads(sys.argv[1])
    # If the parent has ended, writing ends this process without a message.
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    out = os.fdopen(os.dup(1), "wb", buffering=1 << 16)
    os.dup2(2, 1)  # output of libraries must not mix with the frames
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    for name in SLOW_IMPORTS:
        sys.modules[name] = None  # type: ignore[assignment]  # as if it were not installed
    limit_memory(job["max_bytes"])
    try:
        send_points(job, out)
    except BaseException as error:  # a panic of the decoder is not an Exception
        text = f"{type(error).__name__}: {error}".encode()[:2000]
        out.write(FRAME.pack(b"E", len(text)) + text)
        out.flush()
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
