"""Round shapes, such as trees and bushes, oppose a tower (thesis 4.4.3, Figure 4.4)."""

from __future__ import annotations

import math
from collections.abc import Mapping

from torch import Tensor

from scenenet.geneo.kernel import (
    GeneoKernel,
    ShapeParameter,
    gaussian_shell,
    per_support,
    shell_sigma,
)
from scenenet.geneo.lattice import Lattice
from scenenet.geneo.registry import register
from scenenet.geneo.sentences import Numbers, Reference, m, shell_width


def _crown_radius(n: Numbers, reference: Reference) -> str:
    return f"distinguishes round shapes {m(2 * abs(n['r']))} across from their surroundings"


def _crown_sigma(n: Numbers, reference: Reference) -> str:
    return shell_width(n, centre="the voxel", subtracted="omega")


def _crown_omega(n: Numbers, reference: Reference) -> str:
    omega = n["omega"]
    if omega <= 0:
        return "nothing is subtracted: round shapes support a tower, and other points do not count"
    if omega >= 1:
        return "every occupied voxel within the kernel opposes a tower"
    height = abs(n["sigma"]) * math.sqrt(-2 * math.log(omega))
    outer = math.sqrt(n["r"] ** 2 + height)
    return f"each occupied voxel beyond {m(outer)} lowers the response, by up to {omega:.2f}"


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
            "radius of the tree crowns",
            metric=(0.1, 1.5),
            sentence=_crown_radius,
        ),
        shell_sigma("tolerance around that radius", _crown_sigma),
        ShapeParameter(
            "omega",
            0.05,
            0.15,
            "1",
            "penalty for points all around",
            metric=(0.02, 0.6),
            sentence=_crown_omega,
        ),
    )

    def sample(self, lattice: Lattice, shape: Mapping[str, Tensor]) -> Tensor:
        squared = lattice.planar_squared + lattice.z**2
        kernel = gaussian_shell(squared, shape["r"] ** 2, shape["sigma"]) - shape["omega"]
        return per_support(kernel, lattice)
