"""How much memory a process has used."""

from __future__ import annotations

import sys
from typing import Any


def used() -> dict[str, Any]:
    """``peak_memory_mb``: the largest resident set of this process so far, libraries included, MB
    of 10^6 bytes; None on systems that do not report it."""
    try:
        import resource
    except ImportError:  # Windows
        return {"peak_memory_mb": None}
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return {"peak_memory_mb": peak * (1 if sys.platform == "darwin" else 1024) / 1e6}
