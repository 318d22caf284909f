"""Freed memory goes back to the system."""

from __future__ import annotations

import ctypes
import sys
from pathlib import Path

import pytest

from scenenet.core.free_memory import give_back


def resident_mb() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 1e6


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_freed_memory_goes_back():
    if not hasattr(ctypes.CDLL(None), "malloc_trim"):
        pytest.skip("not glibc")
    blocks = [bytes(2000) for _ in range(100_000)]
    kept = blocks[::1000]  # between them, so that what is free does not lie at the end
    before = resident_mb()
    del blocks
    give_back()
    assert before - resident_mb() > 100
    assert len(kept) == 100
