"""Options and arguments that several commands share."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from scenenet.pointcloud.class_schemes import SCHEMES, difference

Codes = StrEnum("Codes", {name: name for name in SCHEMES})  # type: ignore[misc]
"""Class schemes; see ``scenenet.pointcloud.class_schemes``."""


class Fit(StrEnum):
    """Grids; see ``scenenet.dataset.voxels``."""

    cube = "cube"
    metric = "metric"


class TrainedBy(StrEnum):
    """Protocols; see ``scenenet.models.settings``."""

    operational = "operational"
    thesis = "thesis"


class Kind(StrEnum):
    """Architectures; see ``scenenet.models.scenenet``."""

    scenenet = "scenenet"
    cnn = "cnn"


Surveys = Annotated[
    list[Path], typer.Argument(help="LAS, LAZ or COPC surveys, TS40K .npy or .pt samples.")
]


Labelled = Annotated[
    list[Path],
    typer.Argument(
        help="Labelled surveys (LAS, LAZ, COPC), TS40K .npy or .pt samples, folders of samples."
    ),
]


ModelFile = Annotated[Path, typer.Option("--model", help="Model file (.json or .safetensors).")]


LabelCodes = Annotated[
    Codes,
    typer.Option("--codes", help=f"Class scheme of the labels ({difference()})."),
]


MinWire = Annotated[
    float | None,
    typer.Option(
        min=0,
        help="How far wires must be followed from a tower, as a part of the way from 3 to 20 m off "
        "it; 0.75 if not given, 0 for towers that carry none.",
    ),
]
