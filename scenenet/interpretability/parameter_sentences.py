"""A SCENE-Net's numbers in metres, each read out in a sentence (thesis 5.2.2, Figure 5.5).

The sentences follow from the formulas of the kernels (thesis 4.4) and from nothing else. A kernel
that has none here is read by the meaning that stands beside each of its parameters.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from scenenet.geneo import ShapeParameter
    from scenenet.geneo.sentences import Numbers, Surroundings
    from scenenet.models.geneo_model import GeneoModel


class Parameter(NamedTuple):
    """One number of a SCENE-Net.

    Attributes:
        name: as in histories, such as ``cylinder.r`` or ``lambda.arrow``.
        symbol: as the thesis writes it.
        unit: ``m``, ``m^2`` or ``1``.
        factor: what a value is multiplied by that is in voxels.
    """

    name: str
    symbol: str
    unit: str
    factor: float


def parameters_of(model: GeneoModel, voxel_size: float) -> list[Parameter]:
    """The numbers of a model in the order of ``SceneNet.shape_parameters``.

    Args:
        voxel_size: m, edge of the voxels that kernels in voxels were trained on.
    """
    # Here, because who only wants to know which tables there are need not wait for torch.
    from scenenet.geneo import kernel_named

    metres = model.length_unit_m(voxel_size)
    found = []
    for name, geneo in zip(model.names, model.geneos, strict=True):
        for parameter in kernel_named(geneo).parameters:
            factor = {"voxel": metres, "voxel^2": metres**2}.get(parameter.unit, 1.0)
            label = f"{name}.{parameter.name}"
            found.append(Parameter(label, parameter.name, parameter.metric_unit, factor))
    return found + [Parameter(f"lambda.{name}", "lambda", "1", 1.0) for name in model.names]


def sentences(
    model: GeneoModel, values: Mapping[str, float], beside: Surroundings | None = None
) -> dict[str, str]:
    """What each number says.

    Args:
        values: of ``parameters_of``, by name, in metres.
        beside: what lengths are put beside.
    """
    # Here, because who only wants to know which tables there are need not wait for torch.
    from scenenet.geneo import kernel_named
    from scenenet.geneo.sentences import ALONE

    said = {}
    for name, geneo in zip(model.names, model.geneos, strict=True):
        kernel = kernel_named(geneo)
        numbers = {p.name: values[f"{name}.{p.name}"] for p in kernel.parameters}
        for parameter in kernel.parameters:
            if parameter.sentence is None:
                text = _plain(parameter, numbers[parameter.name])
            else:
                text = parameter.sentence(numbers, beside or ALONE)
            said[f"{name}.{parameter.name}"] = text
    weights = {name: values[f"lambda.{name}"] for name in model.names}
    return said | {f"lambda.{name}": _weight(name, weights) for name in weights}


def _plain(parameter: ShapeParameter, value: float) -> str:
    unit = "" if parameter.metric_unit == "1" else f" {parameter.metric_unit}"
    return f"{parameter.meaning}: {value:.2f}{unit}"


def _weight(name: str, weights: Numbers) -> str:
    order = sorted(weights, key=lambda one: -weights[one])
    place = order.index(name)
    if weights[name] < 0:
        return "negative, so its kernel is turned into its opposite and the mixture is not convex"
    said = {0: "the most", len(order) - 1: "the least"}.get(place, f"number {place + 1}")
    return f"{weights[name]:.1%} of the mixture, {said} of the {len(order)} operators"
