"""Cross entropy instead of the squared error (thesis 5.3.3), from the observer's response H(x).

With p = (tanh H)_+, a voxel costs -log(1 - p) if it is not a tower voxel and -log p if it is one.

- **No tower**: -log(1 - tanh h) = softplus(2 h) - log 2, computed from h = (H)_+ and not from p,
  which is 1 in float32 from h = 9 on. A wrong response costs about 2 h, and its slope 1 + p never
  vanishes. Where H is not positive, p and the cost are 0.
- **Tower**: where ReLU gives exactly 0, the logarithm is not defined. p counts as at least
  ``LEAST`` there, which costs -log ``LEAST``. Like ReLU, this has no slope: a start that is dead
  for the squared error is dead here too.
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
"""Smallest probability of a tower voxel in the loss. It also bounds the slope -1 / p."""


def cross_entropy(
    occupancy: Occupancy,
    kernel: Tensor,
    bias: Tensor | None,
    tower: np.ndarray,
    weights: tuple[float, float],
) -> Tensor:
    """-sum over all voxels of f_w(y) (y log M(x) + (1 - y) log(1 - M(x))); differentiable.

    It needs one volume for the responses of the batch. Everything else uses the voxels with a
    positive response alone; all others have probability 0 and no slope.

    Args:
        occupancy, kernel, bias, tower, weights: as for
            ``scenenet.convolution.observer.squared_error``.

    Returns:
        () of the kernel's dtype.
    """
    answers = convolve(occupancy, kernel).reshape(-1)
    if bias is not None:
        answers = answers + bias
    empty, at_tower = weights
    # Not "> 0", which would drop NaN.
    positive = answers[~(answers <= 0)]
    there = torch.relu(answers[torch.from_numpy(tower)])
    probability = torch.tanh(there.double()).clamp(min=LEAST)
    wrong = empty * (_no_tower(positive).sum() - _no_tower(there).sum())
    return (wrong - at_tower * probability.log().sum()).to(kernel.dtype)


def _no_tower(h: Tensor) -> Tensor:
    """-log(1 - tanh h) for h >= 0, in float64, because the two terms nearly cancel around 0."""
    return softplus(2 * h.double()) - math.log(2)
