"""The body of a tower: long, vertical and narrow (thesis 4.4.1, Figure 4.2)."""

from __future__ import annotations

from collections.abc import Mapping

from torch import Tensor

from scenenet.geneo.kernel import (
    BODY_RADIUS,
    GeneoKernel,
    gaussian_shell,
    seen_shell,
    shell_sigma,
    zero_sum,
)
from scenenet.geneo.lattice import Lattice
from scenenet.geneo.registry import register
from scenenet.geneo.sentences import Numbers, Reference, shell_width


def _body_sigma(n: Numbers, reference: Reference) -> str:
    return shell_width(n, centre="the axis", subtracted="the mean")


@register
class Cylinder(GeneoKernel):
    """g(x) = exp(-(||pi_-3(x - c)||^2 - r^2)^2 / (2 sigma^2)), summing to zero."""

    name = "cylinder"
    sums_to_zero = True
    parameters = (
        BODY_RADIUS,
        shell_sigma("tolerance around that radius", _body_sigma, (0.001, 10.0), "spread"),
    )

    def sample(self, lattice: Lattice, shape: Mapping[str, Tensor]) -> Tensor:
        if lattice.voxel:
            shell = seen_shell(lattice, shape["r"], shape["sigma"])
            return zero_sum(shell.expand(lattice.size), lattice.inside)
        shell = gaussian_shell(lattice.planar_squared, shape["r"] ** 2, shape["sigma"])
        return zero_sum(shell.expand(lattice.size), lattice.inside)
