"""Options that the experiments with a model of wires share."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import get_args

from scenenet.models.packaged import WIRES, packaged_model
from scenenet.synthetic.settings import Kind


def wire_parser(name: str, doc: str | None) -> argparse.ArgumentParser:
    """A command line with the options ``--model`` and ``--kinds``.

    Args:
        name: of the experiment.
        doc: its docstring; the first line is the description.
    """
    parser = argparse.ArgumentParser(
        prog=f"python -m scenenet.experiments.{name}",
        description=doc.splitlines()[0] if doc else None,
    )
    parser.add_argument(
        "--model",
        type=Path,
        default=packaged_model(WIRES),
        help="model of wires (default: that of the package)",
    )
    parser.add_argument("--kinds", nargs="+", choices=get_args(Kind), default=get_args(Kind))
    return parser
