"""A new kernel needs one file and no other change."""

from __future__ import annotations

import sys

import numpy as np
import pytest
import torch

from scenenet.convolution.occupancy import Occupancy
from scenenet.core.errors import InputError
from scenenet.geneo import (
    GeneoKernel,
    ShapeParameter,
    kernel_named,
    kernel_names,
    register,
    registry,
)
from scenenet.geneo import kernels as kernels_package
from scenenet.models.model_file import ModelCard, read_model, write_model
from scenenet.models.scenenet import SceneNet

DISC = """
import torch

from scenenet.geneo import GeneoKernel, ShapeParameter, register, zero_sum


@register
class Disc(GeneoKernel):
    name = "disc"
    parameters = (ShapeParameter("r", 0.5, 3.0, "voxel", "radius of the disc"),)

    def sample(self, lattice, shape):
        disc = torch.sigmoid(shape["r"] ** 2 - lattice.planar_squared)
        return zero_sum(disc.expand(lattice.size))
"""


@pytest.fixture
def own_registry(monkeypatch):
    """Kernels registered in the test are unknown to the others."""
    kernel_names()
    monkeypatch.setattr(registry, "_KERNELS", dict(registry._KERNELS))


@pytest.fixture
def disc(own_registry, monkeypatch, tmp_path):
    """A file with a kernel in the folder of the kernels."""
    (tmp_path / "disc.py").write_text(DISC)
    monkeypatch.setattr(kernels_package, "__path__", [*kernels_package.__path__, str(tmp_path)])
    registry._discover.cache_clear()
    yield
    sys.modules.pop("scenenet.geneo.kernels.disc", None)
    registry._discover.cache_clear()


def test_one_new_file_adds_a_kernel_that_trains_and_is_stored(disc, tmp_path):
    assert "disc" in kernel_names()
    model = SceneNet(["cylinder", "disc"], (5, 5, 5))
    assert model.n_parameters() == 2 + 1 + 1
    scene = Occupancy.of_grids([np.array([31])], [np.ones(1)], (4, 4, 4))
    model(scene).sum().backward()
    assert model.shapes["disc"]["r"].grad is not None

    card = ModelCard(
        name="with-disc", codes="edp", measurement="presence", fit="cube", resolution=64,
        voxel_size=1.0,
    )  # fmt: skip
    write_model(tmp_path / "model.json", model, card)
    back, _ = read_model(tmp_path / "model.json")
    assert back.shape_parameters() == model.shape_parameters()
    assert "radius of the disc" in (tmp_path / "model.json").read_text()


def test_an_unknown_kernel_is_refused_with_the_known_ones():
    with pytest.raises(
        InputError, match=r"unknown GENEO kernel 'disk'.*arrow, .*cylinder, .*negative"
    ):
        kernel_named("disk")


def test_two_kernels_of_one_name_are_refused(own_registry):
    with pytest.raises(ValueError, match="two kernels are called 'cylinder'"):

        @register
        class Other(GeneoKernel):
            name = "cylinder"
            parameters = (ShapeParameter("r", 1.0, 2.0, "voxel", "radius"),)

            def sample(self, lattice, shape):
                return torch.zeros(lattice.size)


def test_a_file_may_be_imported_again(own_registry):
    again = type(kernel_named("cylinder"))
    register(again)
    assert isinstance(kernel_named("cylinder"), again)
