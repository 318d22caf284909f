"""The measurement of a voxel itself."""

from __future__ import annotations

from collections.abc import Mapping

from torch import Tensor

from scenenet.geneo.kernel import Extent, GeneoKernel
from scenenet.geneo.lattice import Lattice
from scenenet.geneo.registry import register


@register
class Identity(GeneoKernel):
    """g(x) = 1 at the centre, and 0 elsewhere: the response is the measurement phi.

    It gives an observer something that the other kernels oppose: "a voxel is thin unless it is in a
    crown" is ``identity`` and ``canopy``.
    """

    name = "identity"
    parameters = ()
    adds_up_height = False

    def sample(self, lattice: Lattice, shape: Mapping[str, Tensor]) -> Tensor:
        return (lattice.squared == 0).to(lattice.z.dtype).expand(lattice.size)

    def extent(self, shape: Mapping[str, float]) -> Extent:
        return Extent(0, 0, 0)
