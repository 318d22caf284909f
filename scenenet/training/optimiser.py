"""Steps of gradient descent by RMSProp, Adam or SGD (thesis 5.2.1, 5.3.4)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

import torch
from torch import Tensor
from torch.nn import Parameter
from torch.optim.adam import adam
from torch.optim.rmsprop import rmsprop
from torch.optim.sgd import sgd

State = dict[str, Tensor]
"""What an optimiser remembers of a parameter."""


class Optimiser:
    """Changes parameters by their gradients, with the defaults of ``torch.optim``.

    Its functions take the steps. Its classes would do the same, but import the compiler of torch,
    which nothing here uses: that takes 2 s and 70 MB in every process that trains.
    """

    def __init__(self, kind: str, parameters: Iterable[Parameter]) -> None:
        """``kind`` is a key of ``STEPS``."""
        self._step, self._remembered = STEPS[kind]
        self.parameters = list(parameters)
        self.state: dict[int, State] = {}
        """Number of a parameter -> its state; empty before the first step."""

    def zero_grad(self) -> None:
        """Forget the gradients."""
        for parameter in self.parameters:
            parameter.grad = None

    @torch.no_grad()
    def step(self, rate: float) -> None:
        """Change every parameter that has a gradient; ``rate`` is the step size."""
        moved = [(n, p) for n, p in enumerate(self.parameters) if p.grad is not None]
        for number, parameter in moved:
            if self._remembered and number not in self.state:
                averages = {name: torch.zeros_like(parameter) for name in self._remembered}
                self.state[number] = {"step": torch.zeros(()), **averages}
        states = [self.state.get(number, {}) for number, _ in moved]
        gradients = [p.grad for _, p in moved if p.grad is not None]
        self._step([p for _, p in moved], gradients, states, rate)

    def load(self, state: Mapping[int, State]) -> None:
        """Continue from the ``state`` of another optimiser of this kind."""
        self.state = dict(state)


Step = Callable[[list[Tensor], list[Tensor], list[State], float], None]
"""Changes parameters in place, given their gradients, their states and the rate."""


def _rmsprop(
    parameters: list[Tensor], gradients: list[Tensor], states: list[State], rate: float
) -> None:
    rmsprop(
        parameters,
        gradients,
        _each(states, "square_avg"),
        [],
        [],
        _each(states, "step"),
        foreach=False,
        lr=rate,
        alpha=0.99,
        eps=1e-8,
        weight_decay=0.0,
        momentum=0.0,
        centered=False,
    )


def _adam(
    parameters: list[Tensor], gradients: list[Tensor], states: list[State], rate: float
) -> None:
    adam(
        parameters,
        gradients,
        _each(states, "exp_avg"),
        _each(states, "exp_avg_sq"),
        [],
        _each(states, "step"),
        foreach=False,
        amsgrad=False,
        beta1=0.9,
        beta2=0.999,
        lr=rate,
        weight_decay=0.0,
        eps=1e-8,
        maximize=False,
    )


def _sgd(
    parameters: list[Tensor], gradients: list[Tensor], states: list[State], rate: float
) -> None:
    sgd(
        parameters,
        gradients,
        [None] * len(parameters),
        foreach=False,
        weight_decay=0.0,
        momentum=0.0,
        lr=rate,
        dampening=0.0,
        nesterov=False,
        maximize=False,
    )


def _each(states: list[State], name: str) -> list[Tensor]:
    return [state[name] for state in states]


STEPS: dict[str, tuple[Step, tuple[str, ...]]] = {
    "rmsprop": (_rmsprop, ("square_avg",)),
    "adam": (_adam, ("exp_avg", "exp_avg_sq")),
    "sgd": (_sgd, ()),
}
"""Optimiser -> its step, and what it remembers of each parameter besides the number of steps."""
