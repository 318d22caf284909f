"""How numba compiles the loops."""

from __future__ import annotations

from typing import Any

COMPILED: dict[str, Any] = {
    # Machine code is kept beside the source, so that only the first run waits for the compiler.
    "cache": True,
    # A division gives infinity instead of an exception, without which no loop around one can use
    # vector registers.
    "error_model": "numpy",
    # A product and a sum may be one instruction. Sums keep their order: same numbers, same answer.
    "fastmath": {"contract"},
}
