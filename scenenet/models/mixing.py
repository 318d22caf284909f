"""How the answers of several operators become one: the convex sum of the thesis (Eq. 4.1), the
maximum, or the product.

What an operator answers is lambda_k h_k. A part is what it contributes to H, the response before
tanh: the parts of a voxel always sum to H, so that tau, shares and explanations follow as for a
sum.
"""

from __future__ import annotations

import torch
from torch import Tensor

from scenenet.models.settings import Mixing

LARGEST = 1 - 2.0**-20
"""Largest product of probabilities; float32 has no finite artanh of 1."""


def mixed(answers: Tensor, mixing: Mixing) -> Tensor:
    """The parts (K, M) of the operators that answer ``answers`` (K, M), lambda_k h_k.

    - convex: H = sum lambda_k h_k. Each part is an answer.
    - maximum: H = max lambda_k h_k. It is the part of the operator that answers most.
    - product: (tanh H)+ = prod (tanh lambda_k h_k)+, each factor in [0, 1]. Where an operator does
      not respond, H is the lowest answer, and its part; elsewhere the parts are in the ratio of
      the answers.
    """
    if mixing == "convex":
        return answers
    if mixing == "maximum":
        return _only(answers, answers.argmax(dim=0))
    product = torch.tanh(answers.clamp(min=0)).prod(dim=0).clamp(max=LARGEST)
    shared = answers / answers.sum(dim=0).clamp(min=torch.finfo(answers.dtype).tiny)
    lowest = _only(answers, answers.argmin(dim=0))
    return torch.where(product > 0, torch.atanh(product) * shared, lowest.clamp(max=0))


def constant(constants: list[float], mixing: Mixing) -> float:
    """A bound of the constant (Eq. 3.2) of a mixture of operators with these ones.

    |max a - max b| is at most the largest |a_k - b_k|. A product of K factors in [0, 1] differs by
    at most the sum of what its factors differ by, as a sum does; this is the constant of
    (tanh H)+ then, because artanh has no constant.
    """
    return max(constants, default=0.0) if mixing == "maximum" else sum(constants)


def _only(answers: Tensor, which: Tensor) -> Tensor:
    """The answers (K, M) of the operators ``which`` (M,), and 0 for all others."""
    chosen = torch.zeros_like(answers)
    return chosen.scatter(0, which[None], answers.gather(0, which[None]))
