"""Signals that end the program end it cleanly: what ``with`` blocks hold is removed."""

from __future__ import annotations

import signal
import sys
from types import FrameType

INTERRUPTED = 130
"""Exit code after Ctrl-C, as in shells: 128 plus the number of the signal."""

ENDING = {INTERRUPTED: "interrupted"} | {
    128 + number: f"ended by {signal.Signals(number).name}"
    for number in (signal.SIGTERM, signal.SIGHUP)
}
"""Exit code -> what happened."""


def end_cleanly_on_signals() -> None:
    """Let SIGTERM and SIGHUP unwind the program, as Ctrl-C does.

    A signal that is ignored stays so: ``nohup`` ignores SIGHUP.
    """
    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) == signal.SIG_DFL:
            signal.signal(number, _exit)


def _exit(number: int, frame: FrameType | None) -> None:
    signal.signal(number, signal.SIG_IGN)  # a second signal must not disturb the removal
    sys.exit(128 + number)
