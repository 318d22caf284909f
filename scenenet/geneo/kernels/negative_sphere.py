"""What is round, as trees and bushes are, speaks against a tower (thesis 4.4.3, Figure 4.4)."""

from __future__ import annotations

from collections.abc import Mapping

from torch import Tensor

from scenenet.geneo.kernel import GeneoKernel, Lattice, ShapeParameter, gaussian_shell
from scenenet.geneo.registry import register


@register
class NegativeSphere(GeneoKernel):
    """g(x) = exp(-(||x - c||^2 - r^2)^2 / (2 sigma^2)) - omega; it does not sum to zero."""

    name = "negative_sphere"
    parameters = (
        ShapeParameter("r", 0.5, 3.0, "voxel", "radius of the crowns it weighs", (0.1, 1.5)),
        ShapeParameter("sigma", 0.5, 3.0, "voxel^2", "tolerance around that radius", (0.15, 2.25)),
        ShapeParameter("omega", 0.05, 0.15, "1", "weight against full surroundings", (0.02, 0.6)),
    )

    def sample(self, lattice: Lattice, shape: Mapping[str, Tensor]) -> Tensor:
        squared = lattice.planar_squared + lattice.z**2
        return gaussian_shell(squared, shape["r"] ** 2, shape["sigma"]) - shape["omega"]
