"""Measures non-expansivity constants with the convolution itself (thesis Eq. 3.2)."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import torch
from torch import Tensor

from scenenet.interpretability.equivariance import response


def worst_pair(kernel: Tensor) -> float:
    """max |H_1 - H_2| / |phi_1 - phi_2| for the worst pair of measurements: one is occupied where
    the kernel is positive, the other where it is negative."""
    k = kernel.numpy()
    one, other = (_response_to(kernel, pattern) for pattern in (k > 0, k < 0))
    return float((one - other).abs().max())


def random_pairs(kernel: Tensor, seed: int) -> float:
    """The same between random windows, with the occupancy of real scenes (2 %) and above."""
    rng = np.random.default_rng(seed)
    windows = [rng.random(kernel.shape) < full for full in (0.02, 0.1, 0.5) for _ in range(10)]
    responses = [_response_to(kernel, window) for window in windows]
    return max(float((one - other).abs().max()) for one, other in pairwise(responses))


def worst_pair_of_model(kernel: Tensor, bias: float) -> float:
    """max |M_1 - M_2| / |phi_1 - phi_2| for two close measurements in [0, 1] near H = 0, where tanh
    is steepest.

    The first measurement balances the positive part of the kernel against the negative part. If the
    bias is larger than any response of the kernel, no such balance exists and the value is lower.
    """
    k = kernel.numpy()
    step = 1e-3 / max(1.0, float(np.abs(k).sum()))
    up, down = max(float(k[k > 0].sum()), 1e-12), max(float(-k[k < 0].sum()), 1e-12)
    on_up = np.clip((down / 2 - bias) / up, step, 0.5)
    on_down = np.clip((on_up * up + bias) / down, step, 1 - step)
    level = np.where(k > 0, on_up, on_down)
    before, after = (_response_to(kernel, level + s * np.sign(k)) + bias for s in (0, step))
    one, other = (torch.relu(torch.tanh(h)) for h in (before, after))
    return float((other - one).abs().max()) / step


def _response_to(kernel: Tensor, window: np.ndarray) -> Tensor:
    """The response to a scene that has ``window`` under the kernel and is empty elsewhere."""
    return response(kernel, torch.from_numpy(window.astype(float)))
