"""Cross entropy in the place of the squared error (thesis 5.3.3), from the observer's answer H(x).

With p = (tanh H)_+ it is -log(1 - p) where there is no tower and -log p where there is one.

- **No tower**: -log(1 - tanh h) = softplus(2 h) - log 2, taken from h = (H)_+ and not from p, which
  is 1 in float32 from h = 9 on. So a wrong answer costs more the surer it is, about 2 h, and its
  slope 1 + p never vanishes. Where H is not positive p is 0, and the cost as well.
- **Tower**: where ReLU answers exactly 0 the logarithm has no value. p counts as at least
  ``LEAST`` there, which costs -log ``LEAST``; like ReLU itself that has no slope, so a start that
  is dead for the squared error is dead here too.
"""

from __future__ import annotations

import math

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import softplus

from scenenet.convolution.convolve import convolve
from scenenet.convolution.occupancy import Occupancy

LEAST = 1e-6
"""The least probability that a tower voxel counts with. It bounds the slope -1 / p as well."""


def cross_entropy(
    occupancy: Occupancy,
    kernel: Tensor,
    bias: Tensor | None,
    tower: np.ndarray,
    weights: tuple[float, float],
) -> Tensor:
    """-sum over all voxels of f_w(y) (y log M(x) + (1 - y) log(1 - M(x))); differentiable.

    It needs one volume for the answers of the batch; all else is of the voxels with a positive
    answer alone, the others being answered 0 and without a slope.

    Args:
        occupancy, kernel, bias, tower, weights: as ``scenenet.convolution.observer.squared_error``
            takes them.

    Returns:
        () of the kernel's dtype.
    """
    answers = convolve(occupancy, kernel).reshape(-1)
    if bias is not None:
        answers = answers + bias
    empty, at_tower = weights
    # Not "> 0", which what is not a number would pass by unseen.
    speaking = answers[~(answers <= 0)]
    there = torch.relu(answers[torch.from_numpy(tower)])
    probability = torch.tanh(there.double()).clamp(min=LEAST)
    wrong = empty * (_no_tower(speaking).sum() - _no_tower(there).sum())
    return (wrong - at_tower * probability.log().sum()).to(kernel.dtype)


def _no_tower(h: Tensor) -> Tensor:
    """-log(1 - tanh h) for h >= 0, in float64: about 0 the two terms are nearly the same."""
    return softplus(2 * h.double()) - math.log(2)
