"""A failing decoder does not affect the program that started it."""

from __future__ import annotations

import ast
import json
import os
import signal
import struct
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from scenenet.core.errors import InputError
from scenenet.pointcloud.las import isolation
from scenenet.pointcloud.las.header import read_header


def decode(path, script: str | None = None, stall_seconds: float = 5.0):
    command = None if script is None else [sys.executable, "-c", script]
    chunks = isolation.decompress(
        read_header(path), 100_000, stall_seconds=stall_seconds, command=command
    )
    return list(chunks)


@pytest.fixture
def laz(make_las):
    return make_las("survey.laz", n=1000)


@pytest.mark.parametrize("endless", ["while True: pass", "import time; time.sleep(60)"])
def test_a_decoder_that_hangs_is_stopped_and_the_file_named(laz, endless):
    start = time.perf_counter()
    with pytest.raises(InputError, match="hung") as caught:
        decode(laz, endless, stall_seconds=0.5)
    assert time.perf_counter() - start < 20
    assert str(laz) in str(caught.value)


def test_a_decoder_that_does_not_get_to_work_is_waited_for(laz):
    real = isolation._command(isolation._job(read_header(laz), 100_000, False, 5.0))
    # It starts in less work than half of the 4 s.
    late = f"import os, time; time.sleep(5); os.execv({real[0]!r}, {real!r})"
    assert sum(map(len, decode(laz, late, stall_seconds=4.0))) == 1000


def test_a_killed_decoder_is_reported_with_its_signal(laz):
    script = "import os, signal; os.kill(os.getpid(), signal.SIGKILL)"
    with pytest.raises(InputError, match="SIGKILL") as caught:
        decode(laz, script)
    assert str(laz) in str(caught.value)


def test_an_aborted_decoder_is_reported_with_its_last_output(laz):
    script = "import os, sys; print('out of memory', file=sys.stderr, flush=True); os.abort()"
    with pytest.raises(InputError, match=r"SIGABRT.*out of memory"):
        decode(laz, script)


def test_a_decoder_that_stops_half_way_is_an_error(laz):
    script = (
        "import sys, struct; o = sys.stdout.buffer;"
        "o.write(struct.pack('<cI', b'P', 10) + bytes(300)); o.write(struct.pack('<cI', b'D', 0))"
    )
    with pytest.raises(InputError, match="10 of 1000 points"):
        decode(laz, script)


def test_a_decoder_that_sends_more_points_than_the_header_has_is_an_error(laz):
    script = "import sys, struct; sys.stdout.buffer.write(struct.pack('<cI', b'P', 4000000000))"
    with pytest.raises(InputError, match="other than points"):
        decode(laz, script)


def test_damage_in_the_compressed_points_is_an_error_or_points_but_never_a_crash(laz, patched):
    start = read_header(laz).las.offset_to_point_data + 60
    for at in range(start, laz.stat().st_size - 200, 997):
        damaged = patched(laz, {at: os.urandom(40)})
        try:
            pieces = decode(damaged)
        except InputError as error:
            assert str(damaged) in str(error)
        else:
            assert sum(map(len, pieces)) == 1000


def test_a_panic_of_the_decoder_becomes_an_error(make_las, patched):
    # Without chunks, of 0 points each, as LASzip 1.2 wrote it; lazrs panics on it.
    laz = make_las("survey.laz", version="1.2", point_format=1, n=1000)
    at = laz.read_bytes().index(b"laszip encoded") - 2 + 54
    early = patched(laz, {at: struct.pack("<H", 1), at + 12: struct.pack("<I", 0)})
    with pytest.raises(InputError, match=r"cannot be decoded.*Panic"):
        decode(early)


def test_a_decoder_that_asks_for_absurd_memory_is_ended(laz, monkeypatch):
    monkeypatch.setattr(isolation, "MAX_BYTES", 2**20)
    with pytest.raises(InputError) as caught:
        decode(laz)
    assert str(laz) in str(caught.value)


def test_no_worker_is_left_when_the_reader_stops_early(make_las):
    path = make_las("survey.laz", n=600_000)
    pieces = isolation.decompress(read_header(path), 100_000)
    next(pieces)
    worker = pieces.gi_frame.f_locals["worker"]
    assert worker.poll() is None
    pieces.close()
    assert worker.poll() is not None


def test_a_worker_ends_when_its_parent_ends(make_las):
    path = make_las("survey.laz", n=600_000)
    parent = (
        "import sys, os, signal\n"
        "from scenenet.pointcloud.las import isolation\n"
        "from scenenet.pointcloud.las.header import read_header\n"
        f"pieces = isolation.decompress(read_header({str(path)!r}), 100_000)\n"
        "next(pieces)\n"
        "print(pieces.gi_frame.f_locals['worker'].pid, flush=True)\n"
        "os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    done = subprocess.run([sys.executable, "-c", parent], capture_output=True, text=True)
    assert done.returncode == -signal.SIGKILL, done.stderr
    assert ended_within(int(done.stdout), 5.0)


def test_a_worker_whose_decoder_never_returns_ends_itself(laz):
    job = isolation._job(read_header(laz), 100_000, False, 5.0) | {"watchdog_s": 1}
    script = (
        "import json, sys\n"
        "from scenenet.pointcloud.las import decoder\n"
        "class Endless:\n"
        "    def __enter__(self):\n"
        "        while True: pass\n"
        "    __exit__ = None\n"
        "decoder.open_points = lambda *_: Endless()\n"
        f"sys.argv = ['decoder', {json.dumps(job)!r}]\n"
        "sys.exit(decoder.main())\n"
    )
    done = subprocess.run([sys.executable, "-c", script], timeout=30, capture_output=True)
    assert done.returncode == -signal.SIGALRM


def test_the_worker_starts_without_what_is_slow_to_import(laz):
    job = isolation._job(read_header(laz), 100_000, False, 5.0)
    script = (
        "import io, os, sys\n"
        "from importlib.machinery import SourceFileLoader\n"
        f"decoder = SourceFileLoader('decoder', {isolation.decoder.__file__!r}).load_module()\n"
        f"sys.argv = ['decoder', {json.dumps(job)!r}]\n"
        "code = decoder.main()\n"
        "print(sorted(name for name in sys.modules if '.' not in name), file=sys.stderr)\n"
        "sys.exit(code)\n"
    )
    done = subprocess.run([sys.executable, "-P", "-c", script], capture_output=True, check=True)
    imported = set(ast.literal_eval(done.stderr.decode().splitlines()[-1]))
    assert "lazrs" in imported
    assert not imported & {"scenenet", "laspy", "numpy", "torch", "pandas"}


def test_whole_records_are_the_bytes_of_the_uncompressed_file(make_las):
    las, laz = make_las("a.las", point_format=3, n=500), make_las("a.laz", point_format=3, n=500)
    records = np.concatenate(list(isolation.decompress(read_header(laz), 200)))
    assert records.tobytes() == las.read_bytes()[read_header(las).las.offset_to_point_data :]


def ended_within(pid: int, seconds: float) -> bool:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return True
        if Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] == "Z":
            return True
        time.sleep(0.05)
    return False
