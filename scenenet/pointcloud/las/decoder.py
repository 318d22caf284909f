"""The worker that decompresses LAZ points with laspy, in a separate process.

A damaged file can make a LAZ decoder loop forever, panic, abort its process or allocate all memory.
This then ends the worker alone: the parent (``isolation``) detects it and names the file.

It is started with one argument, a JSON object (see ``isolation._job``), and writes frames to
stdout: a kind (one byte), a number (4 bytes), and the data.

- ``W`` 0: still at work.
- ``P`` n: n whole point records.
- ``E`` n: n bytes of text: the error of the decoder.
- ``C`` n: n bytes of text: the header does not claim the points that the chunks hold.
- ``D`` 0: all points were sent.

Decoders return as many points as they are told to, so a header that claims fewer points than the
chunks hold would lose the others without an error. The worker therefore counts first. Layered
chunks (point formats 6 to 10) store their number of points, as does the table of chunks of variable
size. Other chunks are full except the last, and a coder leaves no byte of a chunk unused: if the
points of the last chunk can be decoded without its last bytes, there are more of them.

It imports nothing of the package, so that it starts fast.
"""

from __future__ import annotations

import io
import json
import os
import resource
import signal
import struct
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

if TYPE_CHECKING:
    import laspy

FRAME = struct.Struct("<cI")
SLOW_IMPORTS = ("pyproj", "requests")
"""Optional imports of laspy that the worker does not need; they take half of its start-up time."""


POINTWISE, LAYERED = 1, 3
"""Compressors: one stream of points, and chunks with a layer for each field."""
LAYERS = {10: 9, 11: 1, 12: 2, 13: 1}
"""Kind of an item of a point -> its layers: the fields of formats 6 to 10, colours, colours with
infrared, and the waveform packet. Extra bytes have a layer each."""
EXTRA_BYTES_ITEM = 14
MIN_CHUNK_BYTES = 20
"""A chunk with points has at least one whole point; some writers add an empty one."""
LEFT_OVER = 1
"""Last bytes of a chunk that its points must need: LASzip and its ports leave no byte unused."""


class WrongCountError(ValueError):
    """The header does not claim as many points as the chunks hold."""


def check_count(header: laspy.LasHeader, job: Mapping[str, Any], out: BinaryIO) -> None:
    """Compare the number of points in the header with what the chunks hold.

    Raises:
        WrongCountError: they differ.
    """
    import lazrs

    record = header.vlrs.get("LasZipVlr")[0].record_data
    compressor = struct.unpack_from("<H", record)[0]
    with Path(job["path"]).open("rb") as stream:
        stream.seek(header.offset_to_point_data)
        if compressor == POINTWISE:
            _check_stream(header, record, stream.read(), job, out)
            return
        layout = lazrs.LazVlr(record)
        chunks = lazrs.read_chunk_table(stream, layout)
        while chunks and chunks[-1][1] < MIN_CHUNK_BYTES:
            chunks.pop()
        start, held = stream.tell(), 0
        if compressor == LAYERED:
            whole, layers = header.point_format.size, _layers(record)
            for _, size in chunks:
                stream.seek(start + whole)
                count, *lengths = struct.unpack(f"<{1 + layers}I", stream.read(4 + 4 * layers))
                if whole + 4 + 4 * layers + sum(lengths) > size:
                    # The decoder would take that much memory before it found out.
                    raise ValueError(f"layers of {sum(lengths)} bytes in a chunk of {size} bytes")
                held += count
                start += size
        elif layout.uses_variable_size_chunks():
            held = sum(points for points, _ in chunks)
        else:
            full = sum(points for points, _ in chunks[:-1])
            stream.seek(start + sum(size for _, size in chunks[:-1]))
            data = stream.read(chunks[-1][1] if chunks else 0)
            _check_last(header, record, full, data, layout.chunk_size())
            return
    if held != header.point_count:
        raise WrongCountError(
            f"the header claims {header.point_count} points, but the compressed chunks hold {held}"
        )


def _layers(record: bytes) -> int:
    """Number of layers of a chunk, from the items that the record of the compression lists."""
    items = struct.unpack_from("<H", record, 32)[0]
    layers = 0
    for item in range(items):
        kind, size = struct.unpack_from("<HH", record, 34 + 6 * item)
        layers += size if kind == EXTRA_BYTES_ITEM else LAYERS[kind]
    return layers


def _check_last(
    header: laspy.LasHeader, record: bytes, full: int, data: bytes, chunk_size: int
) -> None:
    """Check the last chunk, ``data``, that follows ``full`` points."""
    import lazrs

    def fits(n: int, data: bytes) -> bool:
        points = bytearray(n * header.point_format.size)
        everything = lazrs.DecompressionSelection(lazrs.SELECTIVE_DECOMPRESS_ALL)
        try:
            lazrs.decompress_points_with_chunk_table(
                data, record, points, [(n, len(data))], everything
            )
        except lazrs.LazrsError:
            return False
        return True

    n = header.point_count - full
    if not 0 < n <= chunk_size or not fits(n, data):
        raise WrongCountError(_claims(header, "a different number"))
    by_return = int(header.number_of_points_by_return.sum()) - full
    if fits(n, data[:-LEFT_OVER]) or (n < by_return <= chunk_size and fits(by_return, data)):
        raise WrongCountError(_claims(header, "more"))


def _check_stream(
    header: laspy.LasHeader, record: bytes, data: bytes, job: Mapping[str, Any], out: BinaryIO
) -> None:
    """Check one stream of points without chunks."""
    import lazrs

    stream = lazrs.LasZipDecompressor(io.BytesIO(data[:-LEFT_OVER]), record)
    left = header.point_count
    while left:
        n = min(job["piece"], left)
        signal.alarm(job["watchdog_s"])
        try:
            stream.decompress_many(bytearray(n * header.point_format.size))
        except lazrs.LazrsError:
            return  # the last bytes are needed
        out.write(FRAME.pack(b"W", 0))
        out.flush()
        left -= n
    raise WrongCountError(_claims(header, "more"))


def _claims(header: laspy.LasHeader, held: str) -> str:
    by_return = int(header.number_of_points_by_return.sum())
    also = ""
    if by_return not in (0, header.point_count):
        also = f" (its numbers of points by return sum to {by_return})"
    return f"the header claims {header.point_count} points, but the file holds {held}{also}"


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
    """Decompress in pieces and send each piece at once, after a check of their number.

    No piece crosses the border of two chunks of ``job["chunk"]`` points.
    """
    # The parent stops a worker that hangs. If the parent has ended, this alarm does so a little
    # later. It is a signal with its default action, so it works inside a decoder that never returns
    # to Python.
    signal.alarm(job["watchdog_s"])
    with open_points(job) as reader:
        check_count(reader.header, job, out)
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
        if wrong := isinstance(error, WrongCountError):
            text = str(error).encode()
        else:
            text = f"{type(error).__name__}: {error}".encode()[:2000]
        out.write(FRAME.pack(b"C" if wrong else b"E", len(text)) + text)
        out.flush()
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
