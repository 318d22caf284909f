"""``scenenet bench``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from scenenet.cli.options import AsJson, Codes, LabelCodes
from scenenet.cli.output import show

EXAMPLES = ("scenenet bench --quick",)

CROP_CODES = Codes("edp")
"""Class scheme of the public TS40K crops."""


def command(
    crops: Annotated[
        Path | None, typer.Option(help="Folder of TS40K samples.  [default: synthetic crops]")
    ] = None,
    codes: LabelCodes = CROP_CODES,
    quick: Annotated[
        bool, typer.Option("--quick", help="Time the convolution alone, in less than a minute.")
    ] = False,
    thesis: Annotated[
        bool, typer.Option("--thesis", help="Also train on 565 synthetic crops for 50 epochs.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Time the package against alternative implementations.

    The convolution, the voxelisation and the prediction of a survey are timed, in a few minutes.
    """
    from scenenet.bench import BenchSettings, tables
    from scenenet.bench import bench as run

    settings = BenchSettings(crops=crops, codes=codes.value, quick=quick, thesis=thesis)
    show(run(settings), as_json, tables)
