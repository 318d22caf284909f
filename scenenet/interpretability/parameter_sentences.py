"""The numbers of a SCENE-Net in metres, each with a sentence (thesis 5.2.2, Figure 5.5).

The sentences follow from the formulas of the kernels alone (thesis 4.4). A parameter without a
sentence is described by its ``meaning``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from scenenet.geneo import ShapeParameter
    from scenenet.geneo.sentences import Numbers, Reference
    from scenenet.models.geneo_model import GeneoModel


class Parameter(NamedTuple):
    """One number of a SCENE-Net.

    Attributes:
        name: its name in histories, such as ``cylinder.r`` or ``lambda.arrow``.
        symbol: its symbol in the thesis.
        unit: ``m``, ``m^2`` or ``1``.
        factor: converts the model's value into ``unit``.
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
    metres = model.length_unit_m(voxel_size)
    found = []
    for prefix, stage in model.stages():
        for name, parameter in stage.shape_list():
            factor = {"voxel": metres, "voxel^2": metres**2}.get(parameter.unit, 1.0)
            label = f"{prefix}{name}.{parameter.name}"
            found.append(Parameter(label, parameter.name, parameter.metric_unit, factor))
        found += [Parameter(f"{prefix}lambda.{name}", "lambda", "1", 1.0) for name in stage.names]
    return found


def sentences(
    model: GeneoModel, values: Mapping[str, float], reference: Reference | None = None
) -> dict[str, str]:
    """A sentence for each number, by name.

    Args:
        values: of ``parameters_of``, by name, in metres.
        reference: lengths to compare with.
    """
    # Imported here because the names of tables must be available without loading torch.
    from scenenet.geneo.sentences import Reference

    texts = {}
    for prefix, stage in model.stages():
        for name in stage.names:
            label, parameters = f"{prefix}{name}", stage.parameters_of(name)
            numbers = {p.name: values[f"{label}.{p.name}"] for p in parameters}
            for parameter in parameters:
                text = sentence_of(parameter, numbers, reference or Reference())
                texts[f"{label}.{parameter.name}"] = text
        weights = {name: values[f"{prefix}lambda.{name}"] for name in stage.names}
        texts |= {f"{prefix}lambda.{name}": _weight(name, weights) for name in weights}
    return texts


def sentence_of(parameter: ShapeParameter, numbers: Numbers, reference: Reference) -> str:
    """Describes a parameter of a kernel with these ``numbers``, in metres."""
    if parameter.sentence is not None:
        return parameter.sentence(numbers, reference)
    value = numbers[parameter.name]
    unit = "" if parameter.metric_unit == "1" else f" {parameter.metric_unit}"
    return f"{parameter.meaning}: {value:.2f}{unit}"


def _weight(name: str, weights: Numbers) -> str:
    order = sorted(weights, key=lambda one: -weights[one])
    place = order.index(name)
    if weights[name] < 0:
        return "negative: the kernel counts with the opposite sign, and the mixture is not convex"
    ranks = {0: "the largest weight", len(order) - 1: "the smallest weight"}
    rank = ranks.get(place, f"weight number {place + 1}")
    return f"{weights[name]:.1%} of the mixture, {rank} of the {len(order)} kernels"
