"""The body of a tower: long, vertical and narrow (thesis 4.4.1, Figure 4.2)."""

from __future__ import annotations

from collections.abc import Mapping

from torch import Tensor

from scenenet.geneo.kernel import (
    BASE,
    GeneoKernel,
    Lattice,
    ShapeParameter,
    gaussian_shell,
    zero_sum,
)
from scenenet.geneo.registry import register
from scenenet.geneo.sentences import Numbers, Surroundings, between, body_radius, shell


def _body_sigma(n: Numbers, beside: Surroundings) -> str:
    inner, outer = shell(n["r"], n["sigma"])
    where = between(inner, outer, "the axis")
    return f"points {where} count at least half as much as the best, before the mean is taken off"


@register
class Cylinder(GeneoKernel):
    """g(x) = exp(-(||pi_-3(x - c)||^2 - r^2)^2 / (2 sigma^2)), summing to zero."""

    name = "cylinder"
    sums_to_zero = True
    parameters = (
        ShapeParameter(
            "r",
            0.2,
            2.0,
            "voxel",
            "radius of the tower's body",
            metric=(0.1, 1.5),
            by_hand=BASE,
            sentence=body_radius,
        ),
        ShapeParameter(
            "sigma",
            0.5,
            3.0,
            "voxel^2",
            "tolerance around that radius",
            metric=(0.15, 2.25),
            sentence=_body_sigma,
        ),
    )

    def sample(self, lattice: Lattice, shape: Mapping[str, Tensor]) -> Tensor:
        shell = gaussian_shell(lattice.planar_squared, shape["r"] ** 2, shape["sigma"])
        return zero_sum(shell.expand(lattice.size), lattice.inside)
