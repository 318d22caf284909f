"""A new kernel file with a test beside it, to begin from."""

from __future__ import annotations

from pathlib import Path

from scenenet.core.errors import InputError
from scenenet.core.files import write_text
from scenenet.core.outputs import Output, check_outputs
from scenenet.core.provided_code import KERNELS

KERNEL = '''\
"""A thin vertical column with nothing around it: say here what CLASS responds to."""

from __future__ import annotations

from collections.abc import Mapping

import torch
from torch import Tensor

from scenenet.geneo import GeneoKernel, Lattice, ShapeParameter, register, zero_sum
from scenenet.geneo.sentences import Numbers, Reference, m


def _radius(n: Numbers, reference: Reference) -> str:
    return f"a column {m(2 * n['r'])} wide gives the strongest response"


@register
class CLASS(GeneoKernel):
    """g(x) = exp(-d^2 / (2 r^2)) with d the distance from the vertical axis, summing to zero."""

    name = "NAME"
    sums_to_zero = True
    parameters = (
        ShapeParameter(
            "r",
            0.3,
            1.0,
            "voxel",
            "radius of the column",
            metric=(0.1, 1.5),
            sentence=_radius,
        ),
    )

    def sample(self, lattice: Lattice, shape: Mapping[str, Tensor]) -> Tensor:
        # x and y count only as the distance from the axis, so the kernel looks the same from every
        # side: turning the scene turns the response.
        column = torch.exp(-lattice.planar_squared / (2 * shape["r"] ** 2))
        return zero_sum(column.expand(lattice.size), lattice.inside)
'''

TEST = '''\
"""What the kernel NAME responds to, and properties of a GENEO: pytest test_NAME.py"""

from __future__ import annotations

from pathlib import Path

import torch
from torch import Tensor

from scenenet.geneo import Lattice, kernel_of_file

KERNEL = kernel_of_file(Path(__file__).with_name("NAME.py"))
LATTICE = Lattice.of_extent((13, 9, 9), radius=4.0, voxel_size=1.0)
"""Positions in metres, up to 6 m above and below the centre."""


def sampled() -> tuple[Tensor, dict[str, Tensor]]:
    """The kernel (kz, ky, kx) and its parameters, each in the middle of its range."""
    middle = {p.name: (p.metric_range[0] * p.metric_range[1]) ** 0.5 for p in KERNEL.parameters}
    shape = {name: torch.tensor(value, requires_grad=True) for name, value in middle.items()}
    return KERNEL.sample(LATTICE, shape), shape


def response(occupied: Tensor) -> float:
    """The response at the centre of a scene, given as occupied voxels (kz, ky, kx)."""
    return float((sampled()[0] * occupied).sum().detach())


def test_it_responds_to_its_shape_and_not_to_the_ground() -> None:
    everywhere = torch.ones(LATTICE.size)
    column = everywhere * (LATTICE.planar_squared < 0.25)
    ground = everywhere * (LATTICE.z == 0)
    assert response(column) > 0
    assert abs(response(ground)) < 1e-3 * response(column)
    assert response(everywhere) < response(column)


def test_every_slice_sums_to_zero() -> None:
    kernel, _ = sampled()
    assert float(kernel.sum(dim=(1, 2)).abs().max().detach()) < 1e-4 * float(kernel.abs().sum())


def test_a_quarter_turn_of_the_scene_turns_the_response() -> None:
    kernel, _ = sampled()
    assert torch.allclose(kernel, torch.rot90(kernel, 1, (1, 2)), atol=1e-6)


def test_every_parameter_can_be_trained() -> None:
    kernel, shape = sampled()
    kernel.square().sum().backward()
    for name, value in shape.items():
        assert value.grad is not None and float(value.grad) != 0, name
'''


def write_template(name: str, folder: Path, *, overwrite: bool = False) -> tuple[Path, Path]:
    """Write a kernel file and its test into a folder.

    Args:
        overwrite: replace files that were changed since they were written.

    Returns:
        the paths of the two files.

    Raises:
        InputError: the name cannot be that of a kernel, or there is a kernel of this name.
        OutputError: a file that exists would be replaced.
    """
    if fault := KERNELS.name_fault(name):
        raise InputError(f"{name!r} cannot be the name of a kernel: it {fault}")
    paths = folder / f"{name}.py", folder / f"test_{name}.py"
    title = "".join(part.capitalize() for part in name.split("_"))
    texts = tuple(text.replace("NAME", name).replace("CLASS", title) for text in (KERNEL, TEST))
    if name in KERNELS.known():
        raise InputError(f"there is a kernel called {name!r} already", remedy="Choose another name")
    planned = [
        Output(path, lambda there, text=text: _reads(there, text))  # type: ignore[misc]
        for path, text in zip(paths, texts, strict=True)
    ]
    check_outputs(planned, [], overwrite=overwrite)
    for path, text in zip(paths, texts, strict=True):
        write_text(path, text)
    return paths


def _reads(path: Path, text: str) -> bool:
    try:
        return path.read_text(encoding="utf-8") == text
    except (OSError, ValueError):
        return False
