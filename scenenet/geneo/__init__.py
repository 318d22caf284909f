"""Group-equivariant non-expansive operators: kernels that encode prior knowledge (thesis 4.4)."""

from scenenet.geneo.kernel import Extent, GeneoKernel, ShapeParameter, zero_sum
from scenenet.geneo.lattice import Lattice
from scenenet.geneo.outside import kernel_of_file
from scenenet.geneo.registry import kernel_named, kernel_names, register

__all__ = [
    "Extent",
    "GeneoKernel",
    "Lattice",
    "ShapeParameter",
    "kernel_named",
    "kernel_names",
    "kernel_of_file",
    "register",
    "zero_sum",
]
