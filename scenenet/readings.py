"""A SCENE-Net's numbers in metres, each read out in a sentence (thesis 5.2.2, Figure 5.5).

The sentences follow from the formulas of the kernels (thesis 4.4) and from nothing else. A kernel
that has none here is read by the meaning that stands beside each of its parameters.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from scenenet.geneo import ShapeParameter
    from scenenet.models import SceneNet

Numbers = Mapping[str, float]
"""The parameters of one kernel by their symbol, in metres, square metres or without unit."""


class Surroundings(NamedTuple):
    """What a length is put beside.

    Attributes:
        step: m, what a kernel's height is counted in: the voxel it was trained on, or a metre.
        tower_width: m, mean over the labelled towers; None where nobody measured them.
    """

    step: float = 1.0
    tower_width: float | None = None


ALONE = Surroundings()
HALF = math.sqrt(2 * math.log(2))
"""A shell is at half its height where |d^2 - r^2| is so many sigma."""


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


def parameters_of(model: SceneNet, voxel_size: float) -> list[Parameter]:
    """The numbers of a model in the order of ``SceneNet.shape_parameters``.

    Args:
        voxel_size: m, edge of the voxels that kernels in voxels were trained on.
    """
    # Here, because who only wants to know which tables there are need not wait for torch.
    from scenenet.geneo import kernel_named

    found = []
    for name, geneo in zip(model.names, model.geneos, strict=True):
        for parameter in kernel_named(geneo).parameters:
            factor = _metres(parameter, voxel_size) if model.field is None else 1.0
            label = f"{name}.{parameter.name}"
            found.append(Parameter(label, parameter.name, parameter.metric_unit, factor))
    return found + [Parameter(f"lambda.{name}", "lambda", "1", 1.0) for name in model.names]


def _metres(parameter: ShapeParameter, voxel_size: float) -> float:
    return {"voxel": voxel_size, "voxel^2": voxel_size**2}.get(parameter.unit, 1.0)


def sentences(
    model: SceneNet, values: Mapping[str, float], beside: Surroundings = ALONE
) -> dict[str, str]:
    """What each number says.

    Args:
        values: of ``parameters_of``, by name, in metres.
        beside: what lengths are put beside.
    """
    # Here, because who only wants to know which tables there are need not wait for torch.
    from scenenet.geneo import kernel_named

    said = {}
    for name, geneo in zip(model.names, model.geneos, strict=True):
        kernel = kernel_named(geneo)
        numbers = {p.name: values[f"{name}.{p.name}"] for p in kernel.parameters}
        for parameter in kernel.parameters:
            read = READINGS.get((geneo, parameter.name))
            text = read(numbers, beside) if read else _plain(parameter, numbers[parameter.name])
            said[f"{name}.{parameter.name}"] = text
    weights = {name: values[f"lambda.{name}"] for name in model.names}
    return said | {f"lambda.{name}": _weight(name, weights) for name in weights}


def _plain(parameter: ShapeParameter, value: float) -> str:
    unit = "" if parameter.metric_unit == "1" else f" {parameter.metric_unit}"
    return f"{parameter.meaning}: {value:.2f}{unit}"


def _m(length: float) -> str:
    return f"{length:.1f} m" if length >= 0.95 else f"{length:.2f} m"


def _shell(radius: float, sigma: float) -> tuple[float, float]:
    """Distances between which exp(-(d^2 - r^2)^2 / (2 sigma^2)) is at least one half, m."""
    reach = HALF * abs(sigma)
    return math.sqrt(max(radius**2 - reach, 0.0)), math.sqrt(radius**2 + reach)


def _between(inner: float, outer: float, of: str) -> str:
    return f"within {_m(outer)} of {of}" if inner == 0 else f"{_m(inner)} to {_m(outer)} from {of}"


def _body_radius(n: Numbers, beside: Surroundings) -> str:
    width = 2 * abs(n["r"])
    known = beside.tower_width
    share = f", {width / known:.0%} of the mean width of a labelled tower," if known else ""
    return f"a column {_m(width)} wide{share} speaks most for a tower"


def _body_sigma(n: Numbers, beside: Surroundings) -> str:
    inner, outer = _shell(n["r"], n["sigma"])
    where = _between(inner, outer, "the axis")
    return f"points {where} count at least half as much as the best, before the mean is taken off"


def _head_reach(n: Numbers, beside: Surroundings) -> str:
    radius = _head_radius(n)
    share = radius / abs(n["r_c"]) if n["r_c"] else 0.0
    return (
        f"the head is looked for {_m(radius)} from the axis where it begins, which is {share:.0%} "
        "of this reach"
    )


def _head_sigma(n: Numbers, beside: Surroundings) -> str:
    body, head = _shell(n["r"], n["sigma"])[1], _shell(_head_radius(n), n["sigma"])[1]
    return (
        f"points within {_m(body)} of the axis below and {_m(head)} where the head begins count at "
        "least half as much as the best"
    )


def _head_slope(n: Numbers, beside: Surroundings) -> str:
    first, second = (math.sqrt(abs(math.sin(n["beta"] * math.pi / t))) for t in (2, 4))
    turn = "narrows" if second < first else "widens"
    above = _m(2 * beside.step)
    if first == 0:
        return "the head has no width where it begins"
    return f"{above} above where it begins the head {turn} to {second / first:.0%} of its radius"


def _head_radius(n: Numbers) -> float:
    """Radius of the arrow's head where it begins, r_c sqrt(sin(beta pi / 2)), m."""
    return abs(n["r_c"]) * math.sqrt(abs(math.sin(n["beta"] * math.pi / 2)))


def _crown_radius(n: Numbers, beside: Surroundings) -> str:
    return f"round shapes {_m(2 * abs(n['r']))} across are told apart from all around them"


def _crown_sigma(n: Numbers, beside: Surroundings) -> str:
    inner, outer = _shell(n["r"], n["sigma"])
    where = _between(inner, outer, "the voxel")
    return f"points {where} count at least half as much as the best, before omega is taken off"


def _crown_omega(n: Numbers, beside: Surroundings) -> str:
    omega = n["omega"]
    if omega <= 0:
        return "nothing is taken off: what is round speaks for a tower, and the rest does not count"
    if omega >= 1:
        return "every occupied voxel in reach speaks against a tower"
    height = abs(n["sigma"]) * math.sqrt(-2 * math.log(omega))
    outer = math.sqrt(n["r"] ** 2 + height)
    return f"every occupied voxel beyond {_m(outer)} takes {omega:.2f} from the answer"


def _weight(name: str, weights: Numbers) -> str:
    order = sorted(weights, key=lambda one: -weights[one])
    place = order.index(name)
    if weights[name] < 0:
        return "negative, so its kernel is turned into its opposite and the mixture is not convex"
    said = {0: "the most", len(order) - 1: "the least"}.get(place, f"number {place + 1}")
    return f"{weights[name]:.1%} of the mixture, {said} of the {len(order)} operators"


READINGS: Mapping[tuple[str, str], Callable[[Numbers, Surroundings], str]] = {
    ("cylinder", "r"): _body_radius,
    ("cylinder", "sigma"): _body_sigma,
    ("arrow", "r"): _body_radius,
    ("arrow", "sigma"): _head_sigma,
    ("arrow", "r_c"): _head_reach,
    ("arrow", "beta"): _head_slope,
    ("negative_sphere", "r"): _crown_radius,
    ("negative_sphere", "sigma"): _crown_sigma,
    ("negative_sphere", "omega"): _crown_omega,
}
"""(kernel, symbol) -> how it is read."""
