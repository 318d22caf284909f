"""Options and arguments that several commands share."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, get_args

import typer

from scenenet.core.errors import InputError
from scenenet.core.provided_code import KERNELS, MEASUREMENTS
from scenenet.dataset import voxels
from scenenet.models import settings
from scenenet.models.packaged import PACKAGED, named_model, packaged_model
from scenenet.pointcloud.class_schemes import SCHEMES, difference
from scenenet.pointcloud.targets import Target

if TYPE_CHECKING:
    import pyproj

    from scenenet.dataset.voxels import VoxelSettings
    from scenenet.detection.settings import DetectionSettings

_KINDS = get_args(settings.ModelSettings.model_fields["kind"].annotation)
_RESOLUTIONS = get_args(voxels.VoxelSettings.model_fields["resolution"].annotation)


if TYPE_CHECKING:
    Codes = StrEnum
    Fits = StrEnum
    Protocols = StrEnum
    Kinds = StrEnum
    Mixings = StrEnum
else:

    def _choices(name: str, values: Iterable[str]) -> type[StrEnum]:
        return StrEnum(name, {value: value for value in values})

    Codes = _choices("Codes", SCHEMES)
    """Class schemes (``scenenet.pointcloud.class_schemes``)."""
    Fits = _choices("Fits", get_args(voxels.Fit))
    """Ways to lay the grid (``scenenet.dataset.voxels``)."""
    Protocols = _choices("Protocols", get_args(settings.Protocol))
    """Training protocols (``scenenet.models.settings``)."""
    Kinds = _choices("Kinds", _KINDS)
    """Architectures (``scenenet.models.settings``)."""
    Mixings = _choices("Mixings", get_args(settings.Mixing))
    """How kernels become one observer (``scenenet.models.settings``)."""

Survey = Annotated[
    Path,
    typer.Argument(
        help="LAS, LAZ or COPC survey, folder, pattern or index of tiles, or TS40K sample."
    ),
]
Surveys = Annotated[
    list[Path],
    typer.Argument(
        help="LAS, LAZ or COPC surveys, folders, patterns or indexes of tiles, or TS40K samples "
        "(.npy, .pt)."
    ),
]


def _provide(files: list[Path] | None) -> list[Path] | None:
    KERNELS.provide(files or ())
    return files


Kernels = Annotated[
    list[Path] | None,
    typer.Option(
        "--kernels",
        metavar="FILE",
        callback=_provide,
        help="Python file with a kernel, or a folder of them. It is run when a kernel of its name "
        f"is used. May be repeated; {KERNELS.variable} adds more, separated as in PATH.",
    ),
]
"""Files with kernels, which are known once the option is read."""


def _provide_measurements(files: list[Path] | None) -> list[Path] | None:
    MEASUREMENTS.provide(files or ())
    return files


Measurements = Annotated[
    list[Path] | None,
    typer.Option(
        "--measurements",
        metavar="FILE",
        callback=_provide_measurements,
        help="Python file with a measurement phi, or a folder of them. It is run when a "
        f"measurement of its name is used. May be repeated; {MEASUREMENTS.variable} adds more, "
        "separated as in PATH.",
    ),
]
"""Files with measurements, which are known once the option is read."""
Labelled = Annotated[
    list[Path],
    typer.Argument(
        help="Labelled surveys (LAS, LAZ, COPC), TS40K samples (.npy, .pt), or folders of samples."
    ),
]
_MODEL_HELP = (
    "Model file that scenenet train wrote (.json, .safetensors), or a model of the package: "
    f"{' or '.join(PACKAGED)}."
)
ModelFile = Annotated[
    Path,
    typer.Option(
        "--model",
        help=_MODEL_HELP,
        callback=named_model,
        show_default="towers, the model of the package",
        default_factory=packaged_model,
    ),
]
ModelFiles = Annotated[
    list[Path],
    typer.Option(
        "--model",
        help=f"{_MODEL_HELP} Give one for each target that you want to find.",
        callback=lambda given: [named_model(path) for path in given],
        show_default="towers, the model of the package",
        default_factory=lambda: [packaged_model()],
    ),
]
LabelCodes = Annotated[
    Codes, typer.Option("--codes", help=f"Class scheme of the labels ({difference()}).")
]
MinConductor = Annotated[
    float | None,
    typer.Option(
        min=0,
        help="Conductor that a tower must have, all directions added, in units of 17 m: the "
        "stretch from 3 m to 20 m from its axis. 0.75 is 13 m in one direction. 0 accepts towers "
        "without conductors.  [default: 0.75]",
    ),
]
System = Annotated[
    str | None,
    typer.Option(
        "--crs",
        metavar="SYSTEM",
        help="Coordinate system of files that state none: EPSG:CODE, EPSG:CODE+CODE with heights, "
        "or a file with WKT (.prj). A file that states another one is an error.",
    ),
]
FoundTowers = Annotated[
    Path,
    typer.Argument(
        metavar="FOUND",
        help="Tower list that scenenet predict wrote (NAME.towers.csv, NAME.gpkg), or its folder.",
    ),
]
RESOLUTION = 64
"""Voxels along each edge of a crop where none are given (thesis 5.2.1)."""
Resolution = Annotated[
    int,
    typer.Option(
        help=f"Voxels along each edge of a crop: {', '.join(map(str, _RESOLUTIONS))}.",
    ),
]
Overwrite = Annotated[
    bool,
    typer.Option(
        "--overwrite",
        help="Replace files that exist, whoever wrote them. Inputs are never replaced.",
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print the result as JSON on stdout.")]


def cube(resolution: int) -> VoxelSettings:
    """The grid of the thesis with ``resolution`` voxels along each edge.

    Raises:
        typer.BadParameter: there is no such resolution.
    """
    if resolution not in _RESOLUTIONS:
        known = ", ".join(map(str, _RESOLUTIONS))
        raise typer.BadParameter(f"must be one of {known}", param_hint="--resolution")
    return voxels.VoxelSettings(fit="cube", resolution=resolution)


def metric(voxel_size: float) -> VoxelSettings:
    """A grid with voxels of ``voxel_size`` m."""
    return voxels.VoxelSettings(fit="metric", voxel_size=voxel_size)


def target_of(text: str) -> Target:
    """The target of ``--target``.

    Raises:
        typer.BadParameter: there is no such target.
    """
    try:
        return Target.parse(text)
    except InputError as error:
        raise typer.BadParameter(str(error), param_hint="--target") from None


def coordinate_system(text: str | None) -> pyproj.CRS | None:
    """The system of ``--crs``; None if the option is not given.

    Raises:
        typer.BadParameter: there is no such system, or it has no x and y.
    """
    if text is None:
        return None
    from scenenet.pointcloud.las.crs import named_system

    try:
        file = Path(text)
        return named_system(file.read_text(encoding="utf-8") if file.is_file() else text)
    except (OSError, ValueError):  # of the file, and InputError
        raise typer.BadParameter(
            f"{text!r} is neither a coordinate system with x and y, such as EPSG:32629, nor a file "
            "with its WKT",
            param_hint="--crs",
        ) from None


def detection_settings(min_conductor: float | None) -> DetectionSettings:
    """The default settings of the detection, but for ``--min-conductor`` where it is given."""
    from scenenet.detection.settings import DetectionSettings

    given = {} if min_conductor is None else {"min_conductor": min_conductor}
    return DetectionSettings(**given)
