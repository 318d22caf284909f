"""What the command lines of the experiments with a model of wires share."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import get_args

from scenenet.core.errors import InputError
from scenenet.core.scratch import scratch_folder
from scenenet.models.packaged import WIRES, packaged_model
from scenenet.synthetic.settings import Kind


def wire_parser(name: str, doc: str | None, *, several: bool = False) -> argparse.ArgumentParser:
    """A command line with the option ``--model``.

    Args:
        name: of the experiment.
        doc: its docstring: what it is, the command, what it does, each a paragraph. The help has
            the first and the last.
        several: whether more than one model may be named; ``model`` is then a list.
    """
    first, *_, last = (doc or "").strip().split("\n\n")
    parser = argparse.ArgumentParser(
        prog=f"python -m scenenet.experiments.{name}",
        description=first,
        epilog=f"It {last}",
    )
    own = packaged_model(WIRES)
    if several:
        parser.add_argument(
            "--model",
            type=Path,
            nargs="+",
            default=[own],
            help="models of wires, one column each (default: that of the package)",
        )
    else:
        parser.add_argument(
            "--model", type=Path, default=own, help="model of wires (default: that of the package)"
        )
    return parser


def add_kinds(parser: argparse.ArgumentParser) -> None:
    """The option ``--kinds``, kinds of towers."""
    parser.add_argument("--kinds", nargs="+", choices=get_args(Kind), default=get_args(Kind))


def add_line(parser: argparse.ArgumentParser) -> None:
    """The option ``--line``."""
    parser.add_argument(
        "--line",
        action="store_true",
        help="look for towers and lines too, as scenenet predict --line does: points of conductors "
        "are wires, whatever their voxels are",
    )


def print_table(make: Callable[[Path], Sequence[str]]) -> int:
    """Print the lines that ``make`` gives, which may use the folder that it is called with; the
    exit status."""
    try:
        with scratch_folder() as folder:
            lines = make(folder)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    print("\n".join(lines))
    return 0
