"""Numbers between two positive bounds, stored as logits, so that every stored value is allowed."""

from __future__ import annotations

import math

import torch
from torch import Tensor

LOGIT_END = 16.0
"""Largest |logit|: float32 cannot distinguish a sigmoid beyond it from its bound."""


def initial(drawn: Tensor) -> Tensor:
    """The stored number of a first value, from ``drawn`` in [0, 1): no value is at a bound."""
    return torch.logit(0.03 + 0.94 * drawn)


def decoded(stored: Tensor, low: float, high: float) -> Tensor:
    """The number from ``low`` to ``high``; differentiable."""
    return low * (high / low) ** torch.sigmoid(stored)


def encoded(value: float, low: float, high: float) -> float:
    """What ``decoded`` gives ``value`` for; a value beyond a bound is stored as the bound."""
    share = math.log(value / low) / math.log(high / low)
    if share <= 0 or share >= 1:
        return LOGIT_END if share >= 1 else -LOGIT_END
    return max(-LOGIT_END, min(LOGIT_END, math.log(share / (1 - share))))
