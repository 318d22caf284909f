"""How the loops are compiled."""

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

TASKS = 16
"""Parts that a batch is cut into for the cores to share: plane i belongs to part i % TASKS, so that
the full planes near the ground are spread evenly. It is a constant, and not the number of cores,
because a sum over parts must not depend on the machine's cores."""
