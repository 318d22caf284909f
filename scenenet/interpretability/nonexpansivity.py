"""How far apart a kernel's answers can be, in the convolution itself (thesis Eq. 3.2)."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import torch
from torch import Tensor

from scenenet.interpretability.equivariance import answer_of


def worst_pair(kernel: Tensor) -> float:
    """|H_1 - H_2| / |phi_1 - phi_2|: full where the kernel is positive against where negative."""
    k = kernel.numpy()
    one, other = (_answer_to(kernel, pattern) for pattern in (k > 0, k < 0))
    return float((one - other).abs().max())


def random_pairs(kernel: Tensor, seed: int) -> float:
    """The same between random windows as full as scenes are and much fuller."""
    rng = np.random.default_rng(seed)
    windows = [rng.random(kernel.shape) < full for full in (0.02, 0.1, 0.5) for _ in range(10)]
    answers = [_answer_to(kernel, window) for window in windows]
    return max(float((one - other).abs().max()) for one, other in pairwise(answers))


def worst_pair_of_model(kernel: Tensor, bias: float) -> float:
    """|M_1 - M_2| / |phi_1 - phi_2| for close measurements in [0, 1] about H = 0, tanh's steepest.

    The first of them holds the positive part of the kernel and the negative part in balance; a bias
    beyond what the kernel can answer leaves none, and a lower figure.
    """
    k = kernel.numpy()
    step = 1e-3 / max(1.0, float(np.abs(k).sum()))
    up, down = max(float(k[k > 0].sum()), 1e-12), max(float(-k[k < 0].sum()), 1e-12)
    on_up = np.clip((down / 2 - bias) / up, step, 0.5)
    on_down = np.clip((on_up * up + bias) / down, step, 1 - step)
    level = np.where(k > 0, on_up, on_down)
    before, after = (_answer_to(kernel, level + s * np.sign(k)) + bias for s in (0, step))
    one, other = (torch.relu(torch.tanh(h)) for h in (before, after))
    return float((other - one).abs().max()) / step


def _answer_to(kernel: Tensor, window: np.ndarray) -> Tensor:
    """H of a scene that is ``window`` as the kernel's anchor sees it, and empty elsewhere."""
    return answer_of(kernel, torch.from_numpy(window.astype(float)))
