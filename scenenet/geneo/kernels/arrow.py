"""A tower's body with a cone on top, where the conductors meet (thesis 4.4.2, Figure 4.3)."""

from __future__ import annotations

import math
from collections.abc import Mapping

import torch
from torch import Tensor

from scenenet.geneo.kernel import (
    BODY_RADIUS,
    GeneoKernel,
    ShapeParameter,
    column,
    gaussian_shell,
    normalised,
    seen_shell,
    shell_sigma,
    zero_sum,
)
from scenenet.geneo.lattice import Lattice
from scenenet.geneo.registry import register
from scenenet.geneo.sentences import Numbers, Reference, m, shell

CONE_SHARE = 1 / 3
"""Share of the kernel's height that the cone takes. The height h of the cone's base follows from
the kernel's size and is not trained (thesis Figure 5.5), which leaves eleven trained numbers."""


def _head_reach(n: Numbers, reference: Reference) -> str:
    radius = _head_radius(n)
    share = radius / abs(n["r_c"]) if n["r_c"] else 0.0
    return f"the base of the head has a radius of {m(radius)}, which is {share:.0%} of this reach"


def _head_sigma(n: Numbers, reference: Reference) -> str:
    body, head = shell(n["r"], n["sigma"])[1], shell(_head_radius(n), n["sigma"])[1]
    return (
        f"points within {m(body)} of the axis below the head, and within {m(head)} at its base, "
        "have at least half the highest weight"
    )


def _head_slope(n: Numbers, reference: Reference) -> str:
    first, second = (math.sqrt(abs(math.sin(n["beta"] * math.pi / t))) for t in (2, 4))
    turn = "narrows" if second < first else "widens"
    above = m(2 * reference.step)
    if first == 0:
        return "the base of the head has no width"
    return f"{above} above its base the head {turn} to {second / first:.0%} of its radius there"


def _head_radius(n: Numbers) -> float:
    """Radius of the base of the arrow's head, r_c sqrt(sin(beta pi / 2)), m."""
    return abs(n["r_c"]) * math.sqrt(abs(math.sin(n["beta"] * math.pi / 2)))


@register
class Arrow(GeneoKernel):
    """A cylinder of radius r below height h and, from h on, a cone of radius r_c sqrt(sin theta).

    g(x) = exp(-(d^2 - r^2)^2 / (2 sigma^2))                 where z < h
           exp(-(d^2 - r_c^2 sin theta)^2 / (2 sigma^2))     where z >= h
    theta = beta pi / (2 + z - h),  d = ||pi_-3(x - c)||,  summing to zero.

    In kernels with measured numbers it is the head alone: zero where z < h and within r of the
    axis. A column below the head would be a second cylinder, and no data could say which of the two
    has the weight.
    """

    name = "arrow"
    sums_to_zero = True
    parameters = (
        BODY_RADIUS,
        shell_sigma("tolerance around both radii", _head_sigma, (0.01, 100.0), "reach_spread"),
        ShapeParameter(
            "r_c",
            0.5,
            3.0,
            "voxel",
            "reach of the tower's head, where the conductors meet",
            metric=(0.3, 1.5),
            sentence=_head_reach,
            physical=(0.5, 10.0),
            measured="reach",
        ),
        ShapeParameter(
            "beta",
            0.1,
            0.9,
            "1",
            "inclination of the head",
            metric=(0.05, 0.95),
            sentence=_head_slope,
            physical=(0.05, 1.0),
            # The base of the head then has the radius r_c, the reach.
            fixed=1.0,
        ),
    )

    def sample(self, lattice: Lattice, shape: Mapping[str, Tensor]) -> Tensor:
        head_slices = max(1, round(CONE_SHARE * lattice.size[0]))
        above_h = lattice.z - lattice.z[lattice.size[0] - head_slices]
        theta = shape["beta"] * math.pi / (2 + above_h.clamp(min=0))
        if lattice.voxel:
            ring = seen_shell(lattice, shape["r_c"] * torch.sin(theta).sqrt(), shape["sigma"])
            return zero_sum(
                normalised(ring * (above_h >= 0) * (1 - column(lattice, shape["r"]))),
                lattice.inside,
            )
        radius_squared = torch.where(
            above_h < 0, shape["r"] ** 2, shape["r_c"] ** 2 * torch.sin(theta)
        )
        shell = gaussian_shell(lattice.planar_squared, radius_squared, shape["sigma"])
        return zero_sum(shell, lattice.inside)
