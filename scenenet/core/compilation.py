"""How numba compiles the loops."""

from __future__ import annotations

from typing import Any

COMPILED: dict[str, Any] = {
    # Machine code is cached on disk, so that only the first run waits for the compiler.
    "cache": True,
    # A division by zero gives infinity instead of an exception; a loop that may raise cannot use
    # vector registers.
    "error_model": "numpy",
    # A product and a sum may become one instruction. Sums keep their order, so the same input
    # gives the same result.
    "fastmath": {"contract"},
}

EXACT: dict[str, Any] = COMPILED | {"fastmath": False}
"""For what is decided by a comparison: a product and a sum stay two instructions, so that a number
is the one that numpy gives, on every machine."""
