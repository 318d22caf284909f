"""``scenenet train``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, cast

import typer
from pydantic import ValidationError

from scenenet.cli.inputs import Failures
from scenenet.cli.options import (
    RESOLUTION,
    AsJson,
    Kernels,
    Kinds,
    LabelCodes,
    Labelled,
    Measurements,
    Mixings,
    Overwrite,
    Protocols,
    cube,
    metric,
    target_of,
)
from scenenet.cli.output import show, training_lines
from scenenet.core.provided_code import MEASUREMENTS
from scenenet.dataset.square_settings import SquareSettings
from scenenet.dataset.voxels import LARGEST_VOXEL, SMALLEST_VOXEL, VoxelSettings
from scenenet.measurement.registry import PRESENCE
from scenenet.models import settings
from scenenet.models.settings import LARGEST_RATE, THESIS_GENEOS, ModelSettings
from scenenet.pointcloud.targets import ROLES, TOWER, Target
from scenenet.training import presets

EXAMPLES = (
    "scenenet train line.laz --codes edp --out model.json",
    "scenenet train crops/ --codes edp --kind cnn --out cnn.safetensors",
    "scenenet train crops/ --codes edp --target wire --voxel-size 0.5 --out wire.json",
)

Out = Annotated[
    Path, typer.Option("--out", help="Model file to write: .json, or .safetensors for a CNN.")
]
Kind = Annotated[Kinds, typer.Option(help="Architecture.")]
Protocol = Annotated[
    Protocols,
    typer.Option(
        help="operational: a SCENE-Net with kernels in metres, fitted by a search, or a CNN that "
        "starts from Fisher's discriminant. thesis: kernels in voxels, trained by gradient from a "
        "random start."
    ),
]
Seeds = Annotated[
    int, typer.Option(min=1, help="Number of models to train. The best one is written.")
]
Epochs = Annotated[
    int | None,
    typer.Option(
        min=1,
        help="Passes over the crops. Not for an operational SCENE-Net, which is fitted by a "
        f"search.  [default: {presets.EPOCHS}]",
    ),
]
LearningRate = Annotated[
    float | None,
    typer.Option(
        min=1e-6,
        max=LARGEST_RATE,
        help="Step size of RMSProp. Not for an operational SCENE-Net.  [default: "
        f"{presets.LEARNING_RATES['operational']:g} for an operational CNN, "
        f"{presets.LEARNING_RATES['thesis']:g} for protocol thesis]",
    ),
]
Geneos = Annotated[
    str | None,
    typer.Option(
        help="Kernels of a SCENE-Net, separated by commas. cylinder,surroundings has only the "
        "three numbers that do the work (docs/method/numbers.md).  [default: "
        f"{','.join(THESIS_GENEOS)}]",
    ),
]
Mixing = Annotated[
    Mixings,
    typer.Option(
        help="How the kernels of an operational SCENE-Net become one observer: their weighted sum, "
        "the largest weighted response, or the product of their probabilities."
    ),
]
MeasurementOption = Annotated[
    str,
    typer.Option(
        "--measurement",
        metavar="NAME",
        help="What is measured in each voxel, phi, from 0 to 1: "
        f"{', '.join(sorted(MEASUREMENTS.built_in()))}, or that of a file of --measurements.",
    ),
]
TargetOption = Annotated[
    str,
    typer.Option(
        "--target",
        metavar="TARGET",
        help=f"What the model finds: {', '.join(ROLES)}, or class codes of the scheme, such as "
        "14,16, with a name: lamp=14,16.",
    ),
]
Resolution = Annotated[
    int | None,
    typer.Option(
        help=f"Voxels along each edge of a crop; {RESOLUTION} if neither this nor --voxel-size is "
        "given.",
    ),
]
VoxelSize = Annotated[
    float | None,
    typer.Option(
        min=SMALLEST_VOXEL,
        max=LARGEST_VOXEL,
        help="Edge of a voxel in m, the same in every crop, instead of --resolution; "
        + "; ".join(f"{size:g} for --target {name}" for name, size in presets.VOXEL_SIZES.items())
        + ".",
    ),
]
Square = Annotated[
    float,
    typer.Option(
        min=1,
        max=1e4,
        help="Edge in m of the squares that surveys are cut into for another target than towers.",
    ),
]
Validation = Annotated[
    float | None,
    typer.Option(
        min=0,
        max=0.9,
        help="Share of the crops kept to choose the threshold tau on.  [default: 0 for an "
        "operational SCENE-Net, whose eleven parameters hardly overfit; "
        f"{presets.VALIDATION_SHARE:g} for other models]",
    ),
]

DEFAULT_KIND = Kinds("scenenet")
DEFAULT_SQUARE = SquareSettings().edge
DEFAULT_PROTOCOL = Protocols("operational")
DEFAULT_MIXING = Mixings("convex")


def command(
    labelled: Labelled,
    codes: LabelCodes,
    out: Out,
    kind: Kind = DEFAULT_KIND,
    protocol: Protocol = DEFAULT_PROTOCOL,
    seeds: Seeds = 5,
    epochs: Epochs = None,
    learning_rate: LearningRate = None,
    geneos: Geneos = None,
    mixing: Mixing = DEFAULT_MIXING,
    kernels: Kernels = None,
    measurements: Measurements = None,
    measurement: MeasurementOption = PRESENCE,
    resolution: Resolution = None,
    target: TargetOption = TOWER.text,
    voxel_size: VoxelSize = None,
    square: Square = DEFAULT_SQUARE,
    validation: Validation = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Train a model on labelled surveys or crops.

    Surveys are cut into crops around their labelled towers, or, for another --target, into squares
    that hold a point labelled with it.

    Each seed gives a model. Its threshold tau is chosen by F0.5, and the model with the best F0.5
    is written to --out. A file that exists is replaced only if it is a model.

    The exit code is 1 if a file fails; the model is trained on the other files.
    """
    ending = ".json" if kind.value == "scenenet" else ".safetensors"
    if out.suffix != ending:
        raise typer.BadParameter(f"a {kind} is written to a {ending} file", param_hint="--out")
    if mixing.value != "convex" and not presets.is_searched(kind.value, protocol.value):
        raise typer.BadParameter("only for an operational SCENE-Net", param_hint="--mixing")
    finds = target_of(target)
    chosen = _model_settings(
        kind, protocol, epochs, learning_rate, geneos, finds, measurement, mixing
    )
    # After the options, so that a wrong one is named at once.
    from scenenet.cli.trained_files import train_files
    from scenenet.core.files import digest
    from scenenet.core.outputs import Output, check_outputs
    from scenenet.core.provenance import package_version
    from scenenet.detection.settings import DetectionSettings
    from scenenet.models.model_file import is_model_file

    if validation is None:
        validation = presets.validation_share(kind.value, protocol.value)
    check_outputs([Output(out, is_model_file)], labelled, overwrite=overwrite)
    failures = Failures()
    result = train_files(
        labelled,
        codes.value,
        _grid(kind, protocol, finds, resolution, voxel_size),
        chosen,
        presets.TUNING,
        range(seeds),
        validation,
        DetectionSettings(),
        {
            "config": digest(chosen.model_dump()),
            "version": package_version(),
        },
        out,
        failures,
        SquareSettings(edge=square),
    )
    show(result, as_json, training_lines)
    failures.end()


def _model_settings(
    kind: Kinds,
    protocol: Protocols,
    epochs: int | None,
    learning_rate: float | None,
    geneos: str | None,
    finds: Target,
    measurement: str,
    mixing: Mixings,
) -> ModelSettings:
    """The settings of the model to train; a setting that it cannot have is an error of its
    option."""
    try:
        names = None if geneos is None else [name.strip() for name in geneos.split(",")]
        return presets.preset(
            kind.value,
            protocol.value,
            epochs,
            learning_rate,
            names,
            finds,
            measurement=measurement,
            mixing=cast(settings.Mixing, mixing.value),
        )
    except ValidationError as error:
        fault = error.errors()[0]
        option = "--measurement" if "measurement" in fault["loc"] else "--geneos"
        message = fault["msg"].removeprefix("Value error, ")
        raise typer.BadParameter(message, param_hint=option) from None
    except ValueError as error:
        option = "--epochs" if learning_rate is None else "--learning-rate"
        raise typer.BadParameter(f"{error} (use --protocol thesis)", param_hint=option) from None


def _grid(
    kind: Kinds,
    protocol: Protocols,
    finds: Target,
    resolution: int | None,
    voxel_size: float | None,
) -> VoxelSettings:
    """The grid of the crops: that of the options, or else the usual one of the model."""
    if voxel_size is None and resolution is None:
        voxel_size = presets.voxel_size(kind.value, protocol.value, finds)
    if voxel_size is not None:
        return metric(voxel_size)
    return cube(RESOLUTION if resolution is None else resolution)
