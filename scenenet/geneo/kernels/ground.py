"""A surface opposes a line: points in every direction of the plane, such as ground and roofs."""

from __future__ import annotations

from collections.abc import Mapping

from torch import Tensor

from scenenet.geneo.kernel import Extent, GeneoKernel, ShapeParameter
from scenenet.geneo.lattice import Lattice
from scenenet.geneo.registry import register
from scenenet.geneo.sentences import Numbers, Reference, m

ASIDE_VOXELS = 1.5
"""Half width of the strip in voxels: a line of voxels in any direction, and its neighbours."""


def _reach(n: Numbers, reference: Reference) -> str:
    return (
        f"a voxel with points in every direction, up to {m(abs(n['r']))} away, lies in a surface; "
        "one direction without points is enough for a line"
    )


def _rise(n: Numbers, reference: Reference) -> str:
    return f"the surface may rise or fall by {m(abs(n['h']))} within that distance"


@register
class Ground(GeneoKernel):
    """g(x) = -1 / (2 r) in a strip along x: |x| <= r, |z| <= h, and one voxel to each side.

    The operator takes the maximum over all directions, which is minus the occupied length of the
    direction with the fewest points. A straight line has a direction without points other than the
    voxel itself; a surface has none, even with gaps.
    """

    name = "ground"
    adds_up_height = False
    turns = 16
    parameters = (
        ShapeParameter(
            "r",
            4.0,
            10.0,
            "voxel",
            "distance up to which a surface must extend in every direction",
            metric=(2.0, 8.0),
            sentence=_reach,
            # Less than the distance between the circuits of a line, which lie in one plane too.
            fixed=4.0,
        ),
        ShapeParameter(
            "h",
            1.0,
            3.0,
            "voxel",
            "rise of the surface within that distance",
            metric=(0.5, 2.0),
            sentence=_rise,
            # A slope of 25 %.
            fixed=1.0,
        ),
    )

    def sample(self, lattice: Lattice, shape: Mapping[str, Tensor]) -> Tensor:
        step = lattice.step

        def within(distance: Tensor, limit: Tensor | float) -> Tensor:
            return ((limit - distance.abs()) / step + 0.5).clamp(0, 1)

        strip = within(lattice.x, shape["r"]) * within(lattice.z, shape["h"])
        strip = strip * within(lattice.y, ASIDE_VOXELS * step)
        return -strip * (step / (2 * shape["r"] + step))

    def extent(self, shape: Mapping[str, float]) -> Extent:
        return Extent(shape["h"], shape["h"], shape["r"])
