"""Memory that Python has freed goes back to the system between stages of long work."""

from __future__ import annotations

import ctypes
import sys
from functools import cache
from typing import Any


def give_back() -> None:
    """Return freed memory to the system, where the C library is glibc; elsewhere nothing.

    glibc keeps what was freed for later. The next stage needs other sizes and takes more beside it,
    so the peak of several stages is higher than that of any of them.
    """
    trim = _trim()
    if trim is not None:
        trim(0)


@cache
def _trim() -> Any:
    if not sys.platform.startswith("linux"):
        return None
    try:
        return ctypes.CDLL(None).malloc_trim
    except (OSError, AttributeError):  # another C library
        return None
