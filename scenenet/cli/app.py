"""The command line: the workflow's stages for users without Snakemake.

Results go to stdout, progress and messages to stderr. Exit codes: 0 success, 1 faulty input (the
message names the fault), 2 wrong usage.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import Annotated

import typer

from scenenet.cli.commands import (
    bench,
    check,
    evaluate,
    explain,
    geneo,
    predict,
    register,
    review,
    synth,
    train,
)
from scenenet.core.errors import InputError
from scenenet.core.interrupts import ENDING, end_cleanly_on_signals

COMMANDS = {
    "check": check,
    "synth": synth,
    "train": train,
    "predict": predict,
    "evaluate": evaluate,
    "explain": explain,
    "review": review,
    "register": register,
    "bench": bench,
}

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    epilog="scenenet COMMAND --help explains a command, with examples.",
)


def _add(group: typer.Typer, commands: Mapping[str, ModuleType]) -> None:
    for name, module in commands.items():
        heading = "Example:" if len(module.EXAMPLES) == 1 else "Examples:"
        epilog = "\n\n".join([heading, *module.EXAMPLES])
        group.command(name, epilog=epilog)(module.command)


_add(app, COMMANDS)
workbench = typer.Typer(
    no_args_is_help=True, rich_markup_mode=None, help=geneo.HELP, epilog=geneo.EPILOG
)
_add(workbench, geneo.COMMANDS)
app.add_typer(workbench, name="geneo")


def _print_version(wanted: bool) -> None:
    if wanted:
        from scenenet.core.provenance import package_version

        print(f"scenenet {package_version()}")
        raise typer.Exit()


@app.callback()
def _of_every_command(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version and exit."
        ),
    ] = False,
) -> None:
    """Find power-line towers in LiDAR surveys with SCENE-Net, and explain each of them."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line; faulty input ends with its message and exit code 1."""
    end_cleanly_on_signals()
    try:
        app(arguments)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(1)
    except SystemExit as end:
        if end.code in ENDING:  # typer ends like this on Ctrl-C, without a message
            print(f"{ENDING[end.code]}; no incomplete file was left", file=sys.stderr)
        raise
