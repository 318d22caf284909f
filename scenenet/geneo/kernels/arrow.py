"""A tower's body with a cone on top for the lines that meet there (thesis 4.4.2, Figure 4.3)."""

from __future__ import annotations

import math
from collections.abc import Mapping

import torch
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
from scenenet.geneo.sentences import Numbers, Surroundings, body_radius, m, shell

CONE_SHARE = 1 / 3
"""Share of the kernel's height that the cone takes. The height h at which it begins follows from
the kernel's size and is not trained (thesis Figure 5.5), which leaves eleven trained numbers."""


def _head_reach(n: Numbers, beside: Surroundings) -> str:
    radius = _head_radius(n)
    share = radius / abs(n["r_c"]) if n["r_c"] else 0.0
    return (
        f"the head is looked for {m(radius)} from the axis where it begins, which is {share:.0%} "
        "of this reach"
    )


def _head_sigma(n: Numbers, beside: Surroundings) -> str:
    body, head = shell(n["r"], n["sigma"])[1], shell(_head_radius(n), n["sigma"])[1]
    return (
        f"points within {m(body)} of the axis below and {m(head)} where the head begins count at "
        "least half as much as the best"
    )


def _head_slope(n: Numbers, beside: Surroundings) -> str:
    first, second = (math.sqrt(abs(math.sin(n["beta"] * math.pi / t))) for t in (2, 4))
    turn = "narrows" if second < first else "widens"
    above = m(2 * beside.step)
    if first == 0:
        return "the head has no width where it begins"
    return f"{above} above where it begins the head {turn} to {second / first:.0%} of its radius"


def _head_radius(n: Numbers) -> float:
    """Radius of the arrow's head where it begins, r_c sqrt(sin(beta pi / 2)), m."""
    return abs(n["r_c"]) * math.sqrt(abs(math.sin(n["beta"] * math.pi / 2)))


@register
class Arrow(GeneoKernel):
    """A cylinder of radius r below height h and, from h on, a cone of radius r_c sqrt(sin theta).

    g(x) = exp(-(d^2 - r^2)^2 / (2 sigma^2))                 where z < h
           exp(-(d^2 - r_c^2 sin theta)^2 / (2 sigma^2))     where z >= h
    theta = beta pi / (2 + z - h),  d = ||pi_-3(x - c)||,  summing to zero.
    """

    name = "arrow"
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
            "tolerance around both radii",
            metric=(0.15, 2.25),
            sentence=_head_sigma,
        ),
        ShapeParameter(
            "r_c",
            0.5,
            3.0,
            "voxel",
            "reach of the tower's head, where the lines meet",
            metric=(0.3, 1.5),
            sentence=_head_reach,
        ),
        ShapeParameter(
            "beta",
            0.1,
            0.9,
            "1",
            "inclination of the head",
            metric=(0.05, 0.95),
            sentence=_head_slope,
        ),
    )

    def sample(self, lattice: Lattice, shape: Mapping[str, Tensor]) -> Tensor:
        head_slices = max(1, round(CONE_SHARE * lattice.size[0]))
        above_h = lattice.z - lattice.z[lattice.size[0] - head_slices]
        theta = shape["beta"] * math.pi / (2 + above_h.clamp(min=0))
        radius_squared = torch.where(
            above_h < 0, shape["r"] ** 2, shape["r_c"] ** 2 * torch.sin(theta)
        )
        shell = gaussian_shell(lattice.planar_squared, radius_squared, shape["sigma"])
        return zero_sum(shell, lattice.inside)
