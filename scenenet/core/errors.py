"""The one error that users of the package see: what went wrong, where, and what to do."""

from __future__ import annotations

from pathlib import Path


class InputError(ValueError):
    """The input is at fault (a file, a table, a setting), not the program.

    The message always reads ``FILE: PLACE: PROBLEM. REMEDY``, without the parts that are unknown,
    so that one line of a log is enough to act on. The command line turns it into exit code 1.

    Args:
        problem: what is wrong, as a sentence without a full stop.
        file: the file at fault.
        place: where in the file (a row, a byte, a key), if known.
        remedy: what the user can do, as a sentence without a full stop.
    """

    def __init__(
        self,
        problem: str,
        *,
        file: str | Path | None = None,
        place: str | None = None,
        remedy: str | None = None,
    ) -> None:
        self.problem = problem
        self.file = None if file is None else str(file)
        self.place = place
        self.remedy = remedy
        where = "".join(f"{part}: " for part in (self.file, place) if part)
        super().__init__(where + problem + (f". {remedy}" if remedy else ""))

    def __reduce__(self):  # keyword-only arguments do not survive the default pickling
        return _rebuild, (self.problem, self.file, self.place, self.remedy)


def _rebuild(problem: str, file: str | None, place: str | None, remedy: str | None) -> InputError:
    return InputError(problem, file=file, place=place, remedy=remedy)
