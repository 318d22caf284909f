"""Several inputs in one command: all are looked at first, and one bad file stops no other."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

import typer

from scenenet.core.errors import InputError

Input = TypeVar("Input")
Seen = TypeVar("Seen")


class Failures:
    """The inputs of a command that failed, with their errors, while it goes on with the others."""

    def __init__(self) -> None:
        self.errors: list[InputError] = []

    @contextlib.contextmanager
    def collect(self) -> Iterator[None]:
        """Keep an InputError of the block, which deals with one input."""
        try:
            yield
        except InputError as error:
            self.errors.append(error)

    def look_at(self, inputs: Iterable[Input], look: Callable[[Input], Seen]) -> dict[Input, Seen]:
        """What ``look`` returns for each input, without those for which it raises InputError."""
        seen = {}
        for each in inputs:
            with self.collect():
                seen[each] = look(each)
        return seen

    def end(self) -> None:
        """Print every error on stderr.

        Raises:
            typer.Exit: with code 1, if anything failed.
        """
        for error in self.errors:
            print(f"error: {error}", file=sys.stderr)
        if self.errors:
            raise typer.Exit(1)
