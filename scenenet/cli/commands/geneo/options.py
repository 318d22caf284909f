"""Options and arguments that several commands of ``scenenet geneo`` share."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated

import typer

from scenenet.dataset.voxels import LARGEST_VOXEL, SMALLEST_VOXEL
from scenenet.models.settings import LARGEST_LENGTH, MetricSettings

if TYPE_CHECKING:
    from scenenet.interpretability.workbench.one_kernel import OneKernel

_METRIC = MetricSettings()

Name = Annotated[str, typer.Argument(help="Name of the kernel; scenenet geneo list shows all.")]
Values = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="NAME=VALUE",
        help="Value of a parameter, in metres. May be repeated.  [default: the geometric middle of "
        "its range]",
    ),
]
VoxelSize = Annotated[
    float,
    typer.Option(
        min=SMALLEST_VOXEL,
        max=LARGEST_VOXEL,
        help="Edge of a voxel in m. Models observe surveys in voxels of about 1 m.",
    ),
]
Radius = Annotated[
    float,
    typer.Option(
        min=0.01,
        max=LARGEST_LENGTH,
        help="Horizontal reach in m, beyond the body of a tower. This and the next two have no "
        "effect on kernels whose reach follows from their parameters.",
    ),
]
Above = Annotated[float, typer.Option(min=0, max=LARGEST_LENGTH, help="Upward reach in m.")]
Below = Annotated[float, typer.Option(min=0, max=LARGEST_LENGTH, help="Downward reach in m.")]

RADIUS, ABOVE, BELOW = _METRIC.radius, _METRIC.above, _METRIC.below
"""The lengths of the kernels of a model by default, m."""


def sampled(
    name: str,
    values: Iterable[str] | None,
    voxel_size: float,
    radius: float,
    above: float,
    below: float,
) -> OneKernel:
    """The kernel of the options.

    Raises:
        typer.BadParameter: a value of ``--set`` is not NAME=VALUE.
        InputError: there is no such kernel or parameter, or a value is out of its range.
    """
    from scenenet.interpretability.workbench.one_kernel import OneKernel

    metric = MetricSettings(radius=radius, above=above, below=below)
    return OneKernel(name, _numbers(values or ()), voxel_size, metric)


def _numbers(texts: Iterable[str]) -> dict[str, float]:
    numbers = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            numbers[name.strip()] = float(value)
        except ValueError:
            raise typer.BadParameter(
                f"{text!r} is not NAME=VALUE, such as r=0.5", param_hint="--set"
            ) from None
    return numbers
