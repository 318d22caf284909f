"""``scenenet geneo new``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from scenenet.cli.options import Kernels, Overwrite

EXAMPLES = ("scenenet geneo new lamp", "scenenet geneo new lamp --out my_kernels")

HERE = Path()


def command(
    name: Annotated[str, typer.Argument(help="Name of the kernel, in small letters.")],
    out: Annotated[Path, typer.Option("--out", help="Folder for the two files.")] = HERE,
    kernels: Kernels = None,
    overwrite: Overwrite = False,
) -> None:
    """Write a kernel file to begin from, and its test.

    The files are NAME.py and test_NAME.py.

    The test passes as it is written: pytest test_NAME.py. A file that exists is replaced only if
    it was not changed since this command wrote it.
    """
    from scenenet.interpretability.workbench.template import write_template

    kernel, test = write_template(name, out, overwrite=overwrite)
    print(f"{kernel}: the kernel; {test}: its test")
    print(f"look at it: scenenet geneo show {name} --kernels {kernel}")
