"""Values of the kernels that can be calculated by hand (thesis 4.4)."""

from __future__ import annotations

import math

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from scenenet.geneo import Lattice, kernel_named, kernel_names, zero_sum
from scenenet.geneo.kernel import gaussian_shell

SIZES = [(9, 9, 9), (9, 5, 5), (15, 5, 7), (8, 6, 4), (1, 1, 1)]
EXACT = torch.float64

CYLINDER = {"r": 2.0, "sigma": 3.0}
ARROW = {"r": 1.0, "sigma": 0.5, "r_c": 3.0, "beta": 0.5}
SPHERE = {"r": 2.0, "sigma": 1.5, "omega": 0.1}


def sample(name: str, shape: dict[str, float], size=(9, 9, 9)) -> torch.Tensor:
    numbers = {symbol: torch.tensor(value, dtype=EXACT) for symbol, value in shape.items()}
    return kernel_named(name).sample(Lattice.of_size(size, EXACT), numbers)


def shell(squared_distance: float, squared_radius: float, sigma: float) -> float:
    return math.exp(-((squared_distance - squared_radius) ** 2) / (2 * sigma**2))


def test_the_kernels_of_the_thesis_are_registered():
    assert {"cylinder", "arrow", "negative_sphere"} <= set(kernel_names())


def test_the_shell_is_one_on_its_radius_and_falls_off_on_both_sides():
    squared = torch.tensor([0.0, 1.0, 4.0, 5.0, 9.0], dtype=EXACT)
    values = gaussian_shell(squared, torch.tensor(4.0), torch.tensor(3.0)).tolist()
    # exp(-(d^2 - r^2)^2 / (2 sigma^2)) with r = 2, sigma = 3
    assert values == pytest.approx(
        [math.exp(-16 / 18), math.exp(-9 / 18), 1.0, math.exp(-1 / 18), math.exp(-25 / 18)]
    )


@pytest.mark.parametrize("size", SIZES)
def test_the_lattice_is_centred_on_the_anchor(size):
    lattice = Lattice.of_size(size)
    kz, ky, kx = size
    centre = (kz - 1) // 2, (ky - 1) // 2, (kx - 1) // 2
    assert lattice.z[centre[0], 0, 0] == 0
    assert lattice.planar_squared[0, centre[1], centre[2]] == 0
    assert lattice.top == kz // 2  # an even size has one more element above than below
    assert lattice.planar_squared[0, -1, -1] == (ky // 2) ** 2 + (kx // 2) ** 2


@pytest.mark.parametrize("size", [(9, 9), (9, 0, 9), (9, 9, -1)])
def test_an_invalid_size_is_refused(size):
    with pytest.raises(ValueError, match="three positive integers"):
        Lattice.of_size(size)


def test_the_cylinder_is_its_shell_less_the_mean_of_the_slice():
    kernel = sample("cylinder", CYLINDER)
    mean = sum(
        shell(y * y + x * x, 4.0, 3.0) for y in range(-4, 5) for x in range(-4, 5)
    ) / 81  # fmt: skip
    assert kernel[4, 4, 6].item() == pytest.approx(1 - mean)  # at distance r = 2
    assert kernel[4, 4, 4].item() == pytest.approx(math.exp(-16 / 18) - mean)  # at the centre
    assert kernel[4, 5, 5].item() == pytest.approx(math.exp(-4 / 18) - mean)  # d^2 = 2


def test_the_cylinder_is_the_same_at_every_height():
    kernel = sample("cylinder", CYLINDER)
    assert torch.equal(kernel, kernel[:1].expand_as(kernel))


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize(("name", "shape"), [("cylinder", CYLINDER), ("arrow", ARROW)])
def test_each_slice_of_cylinder_and_arrow_sums_to_zero(name, shape, size):
    kernel = sample(name, shape, size)
    assert kernel.shape == size
    assert kernel.sum(dim=(1, 2)).abs().max() < 1e-12


def test_zero_sum_subtracts_the_mean_of_each_slice():
    kernel = torch.tensor([[[1.0, 3.0]], [[5.0, 5.0]]])
    assert zero_sum(kernel).tolist() == [[[-1.0, 1.0]], [[0.0, 0.0]]]


@pytest.mark.parametrize(
    ("kz", "head_slices"), [(1, 1), (3, 1), (5, 2), (8, 3), (9, 3), (15, 5), (21, 7)]
)
def test_the_head_of_the_arrow_takes_the_upper_third(kz, head_slices):
    kernel = sample("arrow", ARROW | {"r": 0.0}, (kz, 9, 9))
    body = sample("cylinder", {"r": 0.0, "sigma": ARROW["sigma"]}, (kz, 9, 9))
    is_body = [torch.allclose(kernel[z], body[z]) for z in range(kz)]
    assert is_body == [True] * (kz - head_slices) + [False] * head_slices


def test_the_head_of_the_arrow_has_the_radius_of_the_thesis():
    beta, r_c, sigma = ARROW["beta"], ARROW["r_c"], ARROW["sigma"]
    kernel = sample("arrow", ARROW)
    for above_h, z in enumerate((6, 7, 8)):  # h is two slices above the centre of nine
        theta = beta * math.pi / (2 + above_h)  # at z = h: beta * pi / 2
        squared_radius = r_c**2 * math.sin(theta)
        values = [[shell(y * y + x * x, squared_radius, sigma) for x in range(-4, 5)]
                  for y in range(-4, 5)]  # fmt: skip
        expected = torch.tensor(values, dtype=EXACT)
        torch.testing.assert_close(kernel[z], expected - expected.mean())


def test_the_body_of_the_arrow_is_a_cylinder():
    body = sample("cylinder", {"r": ARROW["r"], "sigma": ARROW["sigma"]})
    torch.testing.assert_close(sample("arrow", ARROW)[:6], body[:6])


def test_the_negative_sphere_is_a_shell_less_omega():
    kernel = sample("negative_sphere", SPHERE)
    r, sigma, omega = SPHERE["r"], SPHERE["sigma"], SPHERE["omega"]
    assert kernel[4, 4, 4].item() == pytest.approx(shell(0, r**2, sigma) - omega)
    for on_radius in [(4, 4, 6), (4, 2, 4), (6, 4, 4), (2, 4, 4)]:
        assert kernel[on_radius].item() == pytest.approx(1 - omega)
    assert kernel[0, 0, 0].item() == pytest.approx(-omega)


@given(
    st.floats(0, 4), st.floats(0.1, 5), st.floats(0.01, 1), st.sampled_from(SIZES)
)  # fmt: skip
def test_the_negative_sphere_lies_within_minus_omega_and_one_minus_omega(r, sigma, omega, size):
    kernel = sample("negative_sphere", {"r": r, "sigma": sigma, "omega": omega}, size)
    assert kernel.min() >= -omega - 1e-12
    assert kernel.max() <= 1 - omega + 1e-12


def test_the_negative_sphere_does_not_sum_to_zero():
    without = sample("negative_sphere", SPHERE | {"omega": 0.0}).sum()
    kernel = sample("negative_sphere", SPHERE)
    assert kernel.sum().item() == pytest.approx((without - 729 * SPHERE["omega"]).item())
    assert abs(kernel.sum()) > 1


@pytest.mark.parametrize(
    ("name", "shape"),
    [("cylinder", CYLINDER), ("arrow", ARROW), ("negative_sphere", SPHERE)],
)
def test_a_turned_or_mirrored_kernel_is_the_kernel(name, shape):
    kernel = sample(name, shape)
    torch.testing.assert_close(kernel.rot90(1, (1, 2)), kernel)
    torch.testing.assert_close(kernel.flip(2), kernel)


def test_the_arrow_is_not_symmetric_about_its_middle():
    kernel = sample("arrow", ARROW)
    assert not torch.allclose(kernel.flip(0), kernel, atol=0.1)


@pytest.mark.parametrize(
    ("name", "shape"),
    [("cylinder", CYLINDER), ("arrow", ARROW), ("negative_sphere", SPHERE)],
)
@pytest.mark.parametrize("size", [(9, 5, 5), (6, 4, 4)])
def test_kernels_are_differentiable_in_every_parameter(name, shape, size):
    kernel = kernel_named(name)
    symbols = [p.name for p in kernel.parameters]
    assert sorted(symbols) == sorted(shape)
    lattice = Lattice.of_size(size, EXACT)
    numbers = [torch.tensor(shape[s], dtype=EXACT, requires_grad=True) for s in symbols]

    def sampled(*values):
        return kernel.sample(lattice, dict(zip(symbols, values, strict=True)))

    assert torch.autograd.gradcheck(sampled, numbers)
    gradients = torch.autograd.grad((sampled(*numbers) ** 2).sum(), numbers)
    assert all(abs(g) > 1e-9 for g in gradients)


@pytest.mark.parametrize("name", ["cylinder", "arrow", "negative_sphere"])
def test_parameters_have_range_unit_and_meaning(name):
    for parameter in kernel_named(name).parameters:
        assert 0 < parameter.low < parameter.high  # the thesis requires non-negative parameters
        assert parameter.unit in {"voxel", "voxel^2", "1"}
        assert parameter.meaning


@pytest.mark.parametrize("sigma", [0.0, -1e-10, 1e-20, 1e-7, -1e-4])
@pytest.mark.parametrize("radius", [0.0, 1.0, 1.7])
def test_a_shell_without_thickness_is_finite_and_has_zero_slope(sigma, radius):
    distance = torch.arange(0.0, 9.0) ** 2
    width = torch.tensor(sigma, requires_grad=True)
    r = torch.tensor(radius, requires_grad=True)
    shell = gaussian_shell(distance, r**2, width)
    # Only positions exactly at its radius are left.
    assert shell.tolist() == (distance == r.detach() ** 2).float().tolist()
    for slope in torch.autograd.grad(shell.sum(), [width, r]):
        assert slope.item() == 0.0
