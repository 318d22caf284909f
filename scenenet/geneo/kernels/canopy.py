"""Points all around oppose a thin object: crowns, and everything else that fills a volume."""

from __future__ import annotations

from collections.abc import Mapping

from torch import Tensor

from scenenet.geneo.kernel import Extent, GeneoKernel, ShapeParameter, full_ball
from scenenet.geneo.lattice import Lattice
from scenenet.geneo.registry import register
from scenenet.geneo.sentences import Numbers, Reference, m


def _ball(n: Numbers, reference: Reference) -> str:
    return f"points within {m(abs(n['r']))} of a voxel oppose it"


@register
class Canopy(GeneoKernel):
    """g(x) = -1 / (pi r^2) where ||x - c|| <= r, with r in voxels.

    A flat surface through the voxel gives -1. A straight wire gives -2 / (pi r), and what fills a
    volume more than -1: a crown of which a fifth of the voxels is occupied gives -4 r / 15.
    """

    name = "canopy"
    adds_up_height = False
    parameters = (
        ShapeParameter(
            "r",
            2.0,
            6.0,
            "voxel",
            "radius of the ball in which points oppose a thin object",
            metric=(1.0, 4.0),
            sentence=_ball,
            # The air around a conductor, and less than the distance between two circuits.
            fixed=2.0,
        ),
    )

    def sample(self, lattice: Lattice, shape: Mapping[str, Tensor]) -> Tensor:
        return -full_ball(lattice, shape["r"])

    def extent(self, shape: Mapping[str, float]) -> Extent:
        return Extent(shape["r"], shape["r"], shape["r"])
