"""The worker that decompresses LAZ points with lazrs, in a separate process.

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

It imports neither the package nor laspy or numpy, which take most of a second: a line of a thousand
tiles is read several times. What it has to know of the header comes with the job.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import resource
import signal
import struct
import sys
from base64 import b64decode
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

if TYPE_CHECKING:
    import lazrs

FRAME = struct.Struct("<cI")

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


def check_count(job: Mapping[str, Any], record: bytes, out: BinaryIO) -> None:
    """Compare the number of points in the header with what the chunks hold.

    Raises:
        WrongCountError: they differ.
    """
    import lazrs

    compressor = struct.unpack_from("<H", record)[0]
    with Path(job["path"]).open("rb") as stream:
        stream.seek(job["offset"])
        if compressor == POINTWISE:
            _check_stream(job, record, stream.read(), out)
            return
        layout = lazrs.LazVlr(record)
        chunks = lazrs.read_chunk_table(stream, layout)
        while chunks and chunks[-1][1] < MIN_CHUNK_BYTES:
            chunks.pop()
        start, held = stream.tell(), 0
        if compressor == LAYERED:
            whole, layers = job["size"], _layers(record)
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
            _check_last(job, record, full, data, layout.chunk_size())
            return
    if held != job["points"]:
        raise WrongCountError(
            f"the header claims {job['points']} points, but the compressed chunks hold {held}"
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
    job: Mapping[str, Any], record: bytes, full: int, data: bytes, chunk_size: int
) -> None:
    """Check the last chunk, ``data``, that follows ``full`` points."""
    import lazrs

    def fits(n: int, data: bytes) -> bool:
        points = bytearray(n * job["size"])
        everything = lazrs.DecompressionSelection(lazrs.SELECTIVE_DECOMPRESS_ALL)
        try:
            lazrs.decompress_points_with_chunk_table(
                data, record, points, [(n, len(data))], everything
            )
        except lazrs.LazrsError:
            return False
        return True

    n = job["points"] - full
    if not 0 < n <= chunk_size or not fits(n, data):
        raise WrongCountError(_claims(job, "a different number"))
    by_return = job["by_return"] - full
    if fits(n, data[:-LEFT_OVER]) or (n < by_return <= chunk_size and fits(by_return, data)):
        raise WrongCountError(_claims(job, "more"))


def _check_stream(job: Mapping[str, Any], record: bytes, data: bytes, out: BinaryIO) -> None:
    """Check one stream of points without chunks."""
    import lazrs

    stream = lazrs.LasZipDecompressor(io.BytesIO(data[:-LEFT_OVER]), record)
    left = job["points"]
    while left:
        n = min(job["piece"], left)
        signal.alarm(job["watchdog_s"])
        try:
            stream.decompress_many(bytearray(n * job["size"]))
        except lazrs.LazrsError:
            return  # the last bytes are needed
        out.write(FRAME.pack(b"W", 0))
        out.flush()
        left -= n
    raise WrongCountError(_claims(job, "more"))


def _claims(job: Mapping[str, Any], held: str) -> str:
    also = ""
    if job["by_return"] not in (0, job["points"]):
        also = f" (its numbers of points by return sum to {job['by_return']})"
    return f"the header claims {job['points']} points, but the file holds {held}{also}"


@contextlib.contextmanager
def open_points(
    job: Mapping[str, Any], record: bytes
) -> Iterator[lazrs.ParLasZipDecompressor | lazrs.LasZipDecompressor]:
    """The decompressor of the points of ``job``."""
    import lazrs

    size = lazrs.LazVlr(record).item_size()
    if size != job["size"]:
        raise ValueError(
            f"points of {size} bytes are compressed, and the header says {job['size']}"
        )
    fields = lazrs.SELECTIVE_DECOMPRESS_ALL
    if job["places_only"]:  # layered files store each field separately, so the others are skipped
        fields = (
            lazrs.SELECTIVE_DECOMPRESS_XY_RETURNS_CHANNEL
            | lazrs.SELECTIVE_DECOMPRESS_Z
            | lazrs.SELECTIVE_DECOMPRESS_CLASSIFICATION
            | lazrs.SELECTIVE_DECOMPRESS_FLAGS
        )
    with Path(job["path"]).open("rb") as stream:
        stream.seek(job["offset"])
        arguments = stream, record, lazrs.DecompressionSelection(fields)
        try:
            decompressor = lazrs.ParLasZipDecompressor(*arguments)
        except lazrs.LazrsError:  # not in chunks, which only one core can decompress
            stream.seek(job["offset"])
            decompressor = lazrs.LasZipDecompressor(*arguments)
        yield decompressor


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
    record = b64decode(job["record"])
    check_count(job, record, out)
    with open_points(job, record) as decompressor:
        total = job["points"]
        done = 0
        while done < total:
            n = min(job["piece"], job["chunk"] - done % job["chunk"], total - done)
            signal.alarm(job["watchdog_s"])
            points = bytearray(n * job["size"])
            decompressor.decompress_many(points)
            signal.alarm(0)  # the parent may process a piece for any time
            out.write(FRAME.pack(b"P", n))
            out.write(points)
            out.flush()
            done += n
    out.write(FRAME.pack(b"D", 0))
    out.flush()


def main() -> int:
    job = json.loads(sys.argv[1])
    sys.path.append(job["library"])
    # If the parent has ended, writing ends this process without a message.
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    out = os.fdopen(os.dup(1), "wb", buffering=1 << 16)
    os.dup2(2, 1)  # output of libraries must not mix with the frames
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
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
