"""The steps are those of the classes of ``torch.optim``, without the compiler that these import."""

from __future__ import annotations

import subprocess
import sys

import pytest
import torch
from torch.nn import Parameter

from scenenet.training.optimiser import STEPS, Optimiser

CLASSES = {"rmsprop": torch.optim.RMSprop, "adam": torch.optim.Adam, "sgd": torch.optim.SGD}
RATES = (0.1, 0.1, 0.03, 0.01)


def parameters() -> list[Parameter]:
    """A number, a vector, and one that no loss depends on."""
    return [Parameter(torch.tensor(2.0)), Parameter(torch.linspace(-1, 1, 5)),
            Parameter(torch.ones(2))]  # fmt: skip


def loss_of(values: list[Parameter], number: int) -> torch.Tensor:
    height, vector, _ = values
    return ((vector - number) ** 2).sum() * torch.tanh(height) + height**2


def test_every_optimiser_is_compared():
    assert STEPS.keys() == CLASSES.keys()


@pytest.mark.parametrize("kind", CLASSES)
def test_the_steps_are_those_of_torch_to_the_last_bit(kind):
    ours, theirs = parameters(), parameters()
    optimiser, reference = Optimiser(kind, ours), CLASSES[kind](theirs, lr=1.0)
    for number, rate in enumerate(RATES):
        optimiser.zero_grad()
        loss_of(ours, number).backward()
        optimiser.step(rate)
        reference.zero_grad()
        loss_of(theirs, number).backward()
        reference.param_groups[0]["lr"] = rate
        reference.step()
        assert all(torch.equal(one, other) for one, other in zip(ours, theirs, strict=True))
    assert not torch.equal(ours[1], parameters()[1])
    wanted = reference.state_dict()["state"]
    wanted = {n: {k: v for k, v in s.items() if v is not None} for n, s in wanted.items()}
    assert optimiser.state.keys() == {number for number, state in wanted.items() if state}
    for number, state in optimiser.state.items():
        assert state.keys() == wanted[number].keys()
        assert all(torch.equal(value, wanted[number][name]) for name, value in state.items())


@pytest.mark.parametrize("kind", CLASSES)
def test_it_continues_from_the_state_of_another(kind):
    whole, parts = parameters(), parameters()
    optimiser = Optimiser(kind, whole)
    first, second = Optimiser(kind, parts), Optimiser(kind, parts)
    for number, rate in enumerate(RATES):
        if number == 2:
            second.load(first.state)
        for values, stepping in ((whole, optimiser), (parts, first if number < 2 else second)):
            stepping.zero_grad()
            loss_of(values, number).backward()
            stepping.step(rate)
    assert all(torch.equal(one, other) for one, other in zip(whole, parts, strict=True))


def test_the_compiler_of_torch_is_not_imported():
    code = (
        "import sys, torch; from scenenet.training.gradient import Optimiser;"
        "value = torch.nn.Parameter(torch.ones(2)); optimiser = Optimiser('rmsprop', [value]);"
        "optimiser.zero_grad(); value.sum().backward(); optimiser.step(0.1);"
        "print('torch._dynamo' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"
