"""A level surface opposes a volume: points at the height of a voxel, and none above and below."""

from __future__ import annotations

import math
from collections.abc import Mapping

from torch import Tensor

from scenenet.geneo.kernel import Extent, GeneoKernel, ShapeParameter
from scenenet.geneo.lattice import Lattice
from scenenet.geneo.registry import register
from scenenet.geneo.sentences import Numbers, Reference, m


def _reach(n: Numbers, reference: Reference) -> str:
    return f"the surface is looked for within {m(abs(n['r']))}"


def _thickness(n: Numbers, reference: Reference) -> str:
    return (
        f"points up to {m(abs(n['h']))} above and below the voxel lie in the surface, and those up "
        f"to {m(2 * abs(n['h']))} speak against one"
    )


@register
class Plane(GeneoKernel):
    """g(x) = -1 / (pi r^2) where |z| <= h, and 1 / (pi r^2) where h < |z| <= 2 h, within r in plan.

    It sums to zero over each vertical line. A level surface gives -1, a uniform volume 0.
    """

    name = "plane"
    adds_up_height = False
    parameters = (
        ShapeParameter(
            "r",
            2.0,
            6.0,
            "voxel",
            "distance within which a surface is looked for",
            metric=(1.0, 4.0),
            sentence=_reach,
        ),
        ShapeParameter(
            "h",
            1.0,
            3.0,
            "voxel",
            "half thickness of a surface",
            metric=(0.5, 2.0),
            sentence=_thickness,
        ),
    )

    def sample(self, lattice: Lattice, shape: Mapping[str, Tensor]) -> Tensor:
        step, reach, thick = lattice.step, shape["r"], shape["h"]
        disc = ((reach - lattice.planar_squared.sqrt()) / step + 0.5).clamp(0, 1)
        within = ((thick - lattice.z.abs()) / step + 0.5).clamp(0, 1)
        beyond = ((2 * thick - lattice.z.abs()) / step + 0.5).clamp(0, 1) - within
        # Both parts have the same number of voxels only where h is a whole number of them.
        balanced = beyond * (within.sum() / beyond.sum().clamp(min=1e-6)) - within
        return disc * balanced * (step**2 / (math.pi * reach.square()))

    def extent(self, shape: Mapping[str, float]) -> Extent:
        return Extent(2 * shape["h"], 2 * shape["h"], shape["r"])
