"""Kernels with a direction, and the operators that their orbits are."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from scenenet.geneo import Lattice, kernel_named

LINE = {"l": 6.0, "r": 0.4}
GROUND = {"r": 3.0, "h": 1.0}
EXACT = torch.float64


def numbers(shape: dict[str, float]) -> dict[str, torch.Tensor]:
    return {name: torch.tensor(value, dtype=EXACT) for name, value in shape.items()}


def lattice(name: str, shape: dict[str, float], step: float = 0.5) -> Lattice:
    extent = kernel_named(name).extent(shape)
    wide, high = (int(e / step) for e in (extent.around, max(extent.up, extent.down)))
    size = (2 * high + 1, 2 * wide + 1, 2 * wide + 1)
    return Lattice.of_extent(size, extent.around, step, EXACT)


def test_a_turned_lattice_points_along_the_direction():
    turned = Lattice.of_size((3, 5, 5), EXACT).turned(math.radians(90))
    # The kernel's x axis is the y axis of the grid: two voxels along y are two along the kernel.
    assert turned.x[0, 4, 2] == pytest.approx(2)
    assert turned.y[0, 4, 2] == pytest.approx(0, abs=1e-12)
    assert turned.z[2, 0, 0] == 1


def test_a_sloping_lattice_keeps_distances():
    level = Lattice.of_size((5, 7, 7), EXACT)
    turned = level.turned(0.7, slope=0.3)
    torch.testing.assert_close(turned.squared, level.squared.expand(5, 7, 7))
    # One step along the kernel rises by 0.3 of its length in plan.
    direction = np.array([math.cos(0.7), math.sin(0.7), 0.3]) / math.hypot(1, 0.3)
    x, y, z = 3.0, 2.0, 1.0
    assert turned.x[3, 5, 6] == pytest.approx(float(direction @ [x, y, z]))


@pytest.mark.parametrize(("name", "shape"), [("line", LINE), ("ground", GROUND)])
def test_every_turn_is_the_kernel_sampled_in_that_direction(name, shape):
    kernel, box = kernel_named(name), lattice(name, shape)
    orbit = kernel.orbit(box, numbers(shape))
    sampled = [
        kernel.sample(box.turned(2 * math.pi * turn / kernel.turns, slope), numbers(shape))
        for turn in range(kernel.turns)
        for slope in kernel.slopes
    ]
    torch.testing.assert_close(orbit, torch.stack(sampled), rtol=0, atol=1e-12)


@pytest.mark.parametrize(("name", "shape"), [("line", LINE), ("ground", GROUND)])
def test_a_quarter_turn_permutes_the_orbit_to_the_last_digit(name, shape):
    kernel = kernel_named(name)
    orbit = kernel.orbit(lattice(name, shape), numbers(shape))
    per_quarter = len(orbit) // 4
    turned = torch.rot90(orbit, -1, (2, 3))
    assert torch.equal(turned, torch.roll(orbit, -per_quarter, 0))


def test_a_conductor_answers_more_than_a_crown():
    kernel = kernel_named("line")
    box = lattice("line", LINE)
    orbit = kernel.orbit(box, numbers(LINE)).flatten(1)
    wire = torch.zeros(box.size, dtype=EXACT)
    middle = [n // 2 for n in box.size]
    wire[middle[0], middle[1], middle[2] :] = 1
    other_way = torch.zeros(box.size, dtype=EXACT)
    other_way[:, middle[1], middle[2]] = 1  # upright, as the body of a tower
    assert (orbit @ wire.flatten()).max() > 0.9
    assert (orbit @ other_way.flatten()).max() < 0.4


def test_a_surface_has_no_direction_without_points_and_a_line_has():
    kernel = kernel_named("ground")
    box = lattice("ground", GROUND)
    orbit = kernel.orbit(box, numbers(GROUND)).flatten(1)
    surface, wire = torch.zeros(box.size, dtype=EXACT), torch.zeros(box.size, dtype=EXACT)
    surface[box.size[0] // 2] = 1
    wire[box.size[0] // 2, box.size[1] // 2] = 1
    assert (orbit @ surface.flatten()).max() < -2
    assert (orbit @ wire.flatten()).max() > -0.5


def test_the_response_to_volumes_grows_with_the_ball_and_to_a_surface_does_not():
    kernel = kernel_named("canopy")
    found = []
    for radius in (2.0, 4.0):
        box = lattice("canopy", {"r": radius})
        ball = kernel.sample(box, numbers({"r": radius}))
        found.append((float(ball[box.size[0] // 2].sum()), float(ball.sum())))
    assert found[0][0] == pytest.approx(-1, abs=0.1)
    assert found[1][0] == pytest.approx(-1, abs=0.1)
    # A full ball has 4 r / 3 as many voxels as a surface through it, with r in voxels.
    assert found[1][1] / found[0][1] == pytest.approx(2, rel=0.1)


@pytest.mark.parametrize("name", ["line", "ground", "canopy", "plane"])
def test_every_number_of_the_kernel_has_a_gradient(name):
    kernel = kernel_named(name)
    shape = {p.name: sum(p.metric_range) / 2 for p in kernel.parameters}
    tensors = {k: torch.tensor(v, dtype=EXACT, requires_grad=True) for k, v in shape.items()}
    kernel.orbit(lattice(name, shape), tensors).square().sum().backward()
    assert all(float(t.grad.abs()) > 0 for t in tensors.values())


def test_a_surface_opposes_a_volume_and_a_volume_does_not():
    kernel, shape = kernel_named("plane"), {"r": 2.0, "h": 1.0}
    box = lattice("plane", shape)
    values = kernel.sample(box, numbers(shape))
    assert float(values.sum()) == pytest.approx(0, abs=1e-9)
    assert float(values[box.size[0] // 2].sum()) == pytest.approx(-1, abs=0.1)


def test_a_blob_is_the_opposite_of_a_canopy():
    box = lattice("blob", {"r": 2.0})
    blob = kernel_named("blob").sample(box, numbers({"r": 2.0}))
    assert torch.equal(blob, -kernel_named("canopy").sample(box, numbers({"r": 2.0})))
