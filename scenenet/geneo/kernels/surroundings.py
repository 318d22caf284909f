"""Everything around a tower opposes it, whatever its shape."""

from __future__ import annotations

from collections.abc import Mapping

import torch
from torch import Tensor

from scenenet.geneo.kernel import GeneoKernel, per_support
from scenenet.geneo.lattice import Lattice
from scenenet.geneo.registry import register


@register
class Surroundings(GeneoKernel):
    """g(x) = -1 in the support of the kernel; it does not sum to zero. Where numbers are measured,
    each slice sums to -1, so that the response is the occupied share of the surroundings.

    It is the negative sphere (thesis 4.4.3) without the sphere: of its r, sigma and omega only the
    product of omega and the mixing weight changes the scores of a model (docs/method/numbers.md),
    and that is the mixing weight of this kernel.
    """

    name = "surroundings"
    parameters = ()

    def sample(self, lattice: Lattice, shape: Mapping[str, Tensor]) -> Tensor:
        full = -torch.ones(lattice.size, dtype=lattice.z.dtype)
        return per_support(full if lattice.inside is None else full * lattice.inside, lattice)
