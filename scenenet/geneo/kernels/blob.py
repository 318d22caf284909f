"""What fills a volume, such as a crown (the opposite of the kernel canopy)."""

from __future__ import annotations

from collections.abc import Mapping

from torch import Tensor

from scenenet.geneo.kernel import Extent, GeneoKernel, ShapeParameter, full_ball
from scenenet.geneo.lattice import Lattice
from scenenet.geneo.registry import register
from scenenet.geneo.sentences import Numbers, Reference, m


def _ball(n: Numbers, reference: Reference) -> str:
    return f"points within {m(abs(n['r']))} of a voxel support it"


@register
class Blob(GeneoKernel):
    """g(x) = 1 / (pi r^2) where ||x - c|| <= r, with r in voxels.

    A flat surface through the voxel gives 1, a straight wire less, and what fills a volume more.
    """

    name = "blob"
    adds_up_height = False
    parameters = (
        ShapeParameter(
            "r",
            2.0,
            6.0,
            "voxel",
            "radius of the ball in which points support a volume",
            metric=(0.8, 4.0),
            sentence=_ball,
        ),
    )

    def sample(self, lattice: Lattice, shape: Mapping[str, Tensor]) -> Tensor:
        return full_ball(lattice, shape["r"])

    def extent(self, shape: Mapping[str, float]) -> Extent:
        return Extent(shape["r"], shape["r"], shape["r"])
