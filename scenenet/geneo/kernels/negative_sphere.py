"""What is round, as trees and bushes are, speaks against a tower (thesis 4.4.3, Figure 4.4)."""

from __future__ import annotations

import math
from collections.abc import Mapping

from torch import Tensor

from scenenet.geneo.kernel import GeneoKernel, Lattice, ShapeParameter, gaussian_shell
from scenenet.geneo.registry import register
from scenenet.geneo.sentences import Numbers, Surroundings, between, m, shell


def _crown_radius(n: Numbers, beside: Surroundings) -> str:
    return f"round shapes {m(2 * abs(n['r']))} across are told apart from all around them"


def _crown_sigma(n: Numbers, beside: Surroundings) -> str:
    inner, outer = shell(n["r"], n["sigma"])
    where = between(inner, outer, "the voxel")
    return f"points {where} count at least half as much as the best, before omega is taken off"


def _crown_omega(n: Numbers, beside: Surroundings) -> str:
    omega = n["omega"]
    if omega <= 0:
        return "nothing is taken off: what is round speaks for a tower, and the rest does not count"
    if omega >= 1:
        return "every occupied voxel in reach speaks against a tower"
    height = abs(n["sigma"]) * math.sqrt(-2 * math.log(omega))
    outer = math.sqrt(n["r"] ** 2 + height)
    return f"every occupied voxel beyond {m(outer)} takes {omega:.2f} from the answer"


@register
class NegativeSphere(GeneoKernel):
    """g(x) = exp(-(||x - c||^2 - r^2)^2 / (2 sigma^2)) - omega; it does not sum to zero."""

    name = "negative_sphere"
    parameters = (
        ShapeParameter(
            "r",
            0.5,
            3.0,
            "voxel",
            "radius of the crowns it weighs",
            metric=(0.1, 1.5),
            sentence=_crown_radius,
        ),
        ShapeParameter(
            "sigma",
            0.5,
            3.0,
            "voxel^2",
            "tolerance around that radius",
            metric=(0.15, 2.25),
            sentence=_crown_sigma,
        ),
        ShapeParameter(
            "omega",
            0.05,
            0.15,
            "1",
            "weight against full surroundings",
            metric=(0.02, 0.6),
            sentence=_crown_omega,
        ),
    )

    def sample(self, lattice: Lattice, shape: Mapping[str, Tensor]) -> Tensor:
        squared = lattice.planar_squared + lattice.z**2
        return gaussian_shell(squared, shape["r"] ** 2, shape["sigma"]) - shape["omega"]
