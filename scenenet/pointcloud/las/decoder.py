"""The worker that decompresses LAZ points, in a process of its own, with laspy.

A damaged file can make a LAZ decoder loop for ever, panic, abort its process or ask for all the
memory there is. Here that ends this process and nothing else: the parent
(``scenenet.pointcloud.las.isolation``) sees it and names the file.

It is started with one argument, a JSON object (see ``isolation._job``), and answers on stdout with
frames: a kind (one byte), a number (4 bytes), and what they announce.

- ``P`` n: n whole point records.
- ``E`` n: n bytes of text: what the decoder did not like.
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
"""The parent stops a worker that stalls. Where the parent is gone, the worker's own alarm does, a
little later: a signal with its default action, so it works inside a decoder that never comes back
to Python."""
SLOW_IMPORTS = ("pyproj", "requests")
"""What laspy imports where it is there and the worker has no use for: half of its start."""


def open_points(job: Mapping[str, Any]) -> laspy.LasReader:
    """laspy's reader of the points of ``job``."""
    import laspy

    fields = laspy.DecompressionSelection.all()
    if job["places_only"]:  # layered files keep each field apart: the others are skipped
        fields = laspy.DecompressionSelection.base().decompress_z().decompress_classification()
    return laspy.open(job["path"], read_evlrs=False, decompression_selection=fields)


def limit_memory(max_bytes: int) -> None:
    """Let this process have ``max_bytes`` more of address space than it has now (Linux)."""
    statm = Path("/proc/self/statm")
    if not statm.exists():
        return
    limit = int(statm.read_text().split()[0]) * resource.getpagesize() + max_bytes
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    if hard != resource.RLIM_INFINITY:
        limit = min(limit, hard)
    resource.setrlimit(resource.RLIMIT_AS, (limit, hard))


def send_points(job: Mapping[str, Any], out: BinaryIO) -> None:
    """Decompress piece by piece and send each piece as soon as it is there.

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
            signal.alarm(0)  # the parent may take its time with what it gets
            if len(points) != n:
                raise ValueError(f"{len(points)} points where {n} should be")
            out.write(FRAME.pack(b"P", n))
            out.write(np.frombuffer(points.array, np.uint8).data)
            out.flush()
            done += n
    out.write(FRAME.pack(b"D", 0))
    out.flush()


def main() -> int:
    job = json.loads(sys.argv[1])
    # Where the parent is gone, writing ends this process without a word.
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    out = os.fdopen(os.dup(1), "wb", buffering=1 << 16)
    os.dup2(2, 1)  # what a library prints must not get between the frames
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
