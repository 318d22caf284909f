"""The worker that decompresses LAZ points, in a process of its own.

A damaged file can make a LAZ decoder loop for ever, panic, abort its process or ask for all the
memory there is. Here that ends this process and nothing else: the parent
(``scenenet.pointcloud.isolation``) sees it and names the file.

It is started with one argument, a JSON object (see ``isolation.Job``), and answers on stdout with
frames: a kind (one byte), a number (4 bytes), and what they announce.

- ``P`` n: n points. Either n int32 of X, of Y, of Z and n uint8 class bytes, or n whole records.
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
from pathlib import Path
from typing import Any, BinaryIO

FRAME = struct.Struct("<cI")
WATCHDOG_FACTOR = 3
"""The parent stops a worker that stalls. Where the parent is gone, the worker's own alarm does, a
little later: a signal with its default action, so it works inside a decoder that never comes back
to Python."""
PARALLEL_CHUNK_LIMIT = 4_000_000
"""Points in a chunk above which chunks are not decoded side by side: that holds whole chunks."""


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


def open_decompressor(stream: BinaryIO, job: dict[str, Any]):
    import lazrs

    mask = lazrs.SELECTIVE_DECOMPRESS_ALL
    if not job["whole_records"]:  # layered files keep each field apart: the others are skipped
        mask = (
            lazrs.SELECTIVE_DECOMPRESS_XY_RETURNS_CHANNEL
            | lazrs.SELECTIVE_DECOMPRESS_Z
            | lazrs.SELECTIVE_DECOMPRESS_CLASSIFICATION
        )
    selection = lazrs.DecompressionSelection(mask)
    parallel = job["chunked"] and (
        job["variable_chunks"] or job["chunk_size"] <= PARALLEL_CHUNK_LIMIT
    )
    kind = lazrs.ParLasZipDecompressor if parallel else lazrs.LasZipDecompressor
    return kind(stream, bytes.fromhex(job["laszip"]), selection)


def send_points(job: dict[str, Any], out: BinaryIO) -> None:
    """Decompress piece by piece and send each piece as soon as it is there."""
    import numpy as np

    length, at, total = job["record_length"], job["class_byte"], job["n_points"]
    record = np.dtype({
        "names": ["X", "Y", "Z", "c"],
        "formats": ["<i4", "<i4", "<i4", "u1"],
        "offsets": [0, 4, 8, at],
        "itemsize": length,
    })  # fmt: skip
    with Path(job["path"]).open("rb") as stream:
        stream.seek(job["offset"])
        signal.alarm(job["watchdog_s"])
        decompressor = open_decompressor(stream, job)
        buffer = bytearray(length * min(job["piece"], total))
        done = 0
        while done < total:
            n = min(job["piece"], total - done)
            view = memoryview(buffer)[: n * length]
            signal.alarm(job["watchdog_s"])
            decompressor.decompress_many(view)
            signal.alarm(0)  # the parent may take its time with what it gets
            out.write(FRAME.pack(b"P", n))
            if job["whole_records"]:
                out.write(view)
            else:
                points = np.frombuffer(view, record)
                for name in ("X", "Y", "Z", "c"):
                    out.write(np.ascontiguousarray(points[name]).data)
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
