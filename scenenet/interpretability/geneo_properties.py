"""What a given model keeps of the promises of a GENEO (thesis 3.4, 4.3 to 4.5), by number.

A GENEO is equivariant (Eq. 3.1) and non-expansive (Eq. 3.2), and a convex combination of GENEOs is
one. These are statements about functions on R^3 and normalised kernels; a model works with kernels
cut to a box of voxels and not normalised. So each is worked out and measured here.

**Translation** by whole voxels: exact, also at the border, because beyond the grid there is
nothing. By parts of a voxel it is not: the points fall into other voxels.

**Quarter turns about z**: exact where the kernel, centred on its anchor, is its own turned image;
that takes ky = kx and an odd size. A free kernel (the CNN) is not.

**Other angles about z**: not exact. The points fall into other voxels, and the kernel's box has
corners. The first part is also there when nothing but half a voxel's shift is done, so that is
measured beside it.

**Non-expansivity**, in the sup norm. For H = k * phi the least constant is ||k||_1, the sum of
|k|: phi_1 and phi_2 that differ by one with the sign of k reach it. A kernel that sums to zero is
no exception: its answers reach half of ||k||_1 on both sides of zero, and from one end to the other
is all of it. With hundreds of elements ||k||_1 is far above 1, so H as it stands is **not**
non-expansive, and neither are its kernels g_i. What holds:

- H / ||k||_1 is non-expansive, and deciding at tau is deciding H / ||k||_1 at
  artanh(tau) / ||k||_1: the decisions are those of a non-expansive operator.
- tanh and ReLU do not add to the constant, and near H = 0 they do not lower it: for phi in [0, 1]
  (density) that of M = (tanh H)_+ is ||k||_1 too. For phi in {0, 1} (presence) two measurements are
  0 or 1 apart and M lies in [0, 1], so (3.2) holds for M; it would for any kernel.
- One voxel more or less moves H by one element of k at each place, so by max |k| at most.

**Convexity**: the mixing weights sum to one and none is negative, or this one is. In terms of
normalised kernels g_i / ||g_i||_1 the weights are lambda_i ||g_i||_1 / sum_j lambda_j ||g_j||_1, as
convex as the lambda_i are: H is a convex combination of GENEOs times a positive number.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import torch

from scenenet.dataset.voxels import Measurement
from scenenet.geneo import kernel_named
from scenenet.interpretability.equivariance import (
    Scene,
    exact_errors,
    kernel_turn_error,
    sample_scene,
    turns_of,
)
from scenenet.interpretability.nonexpansivity import random_pairs, worst_pair, worst_pair_of_model
from scenenet.interpretability.result import Statement, Turn
from scenenet.models.geneo_model import GeneoModel

if TYPE_CHECKING:
    from scenenet.models.base import VoxelModel

ANGLES_DEG = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0)
"""Turns about z that are measured, degrees."""
ROUNDING = 1e-4
"""Share of max |H| that may be rounding: sums of hundreds of float32 terms in another order."""
CONVEX_ROUNDING = 1e-5
"""What mixing weights in float32 may miss their bounds by."""


@dataclass(frozen=True)
class Kernel:
    """One kernel in numbers.

    Attributes:
        name: of the GENEO.
        weight: lambda, its mixing weight.
        l1: ||g||_1, its non-expansivity constant.
        largest: max |g|.
        total: sum of g.
        slice_sum: the largest |sum| of a horizontal slice.
        sums_to_zero: whether each slice is meant to sum to zero (thesis 4.4.1, 4.4.2).
        share: its weight among normalised kernels, lambda ||g||_1 over the sum of these.
    """

    name: str
    weight: float
    l1: float
    largest: float
    total: float
    slice_sum: float
    sums_to_zero: bool
    share: float


@dataclass(frozen=True)
class Certificate:
    """What was found for one model; see the head of ``scenenet.interpretability.geneo_properties``.

    Attributes:
        kind: architecture.
        measurement: phi of its input.
        kernels: of a SCENE-Net; empty for a model without GENEOs.
        translation_error: the largest |difference| of H under ``SHIFT``, as a share of max |H|.
        quarter_turn_error: the same for the worst of three quarter turns.
        kernel_turn_error: max |k - k turned by a quarter| as a share of max |k|: the reason.
        half_voxel: the scene shifted by half a voxel along x and y.
        turns: the scene turned about z.
        l1: ||k||_1 of the summed kernel: the least constant of H in the sup norm.
        l1_bound: sum of |lambda_i| ||g_i||_1, which l1 never exceeds; l1 itself without GENEOs.
        measured: |H_1 - H_2| / |phi_1 - phi_2| of the worst pair there is, in the convolution.
        measured_random: the largest between random measurements of {0, 1}.
        measured_model: that of M, for the worst pair of measurements a thousandth apart or less.
        answer_low, answer_high: the least and the highest H there can be for phi in [0, 1].
        one_voxel: max |k|, what one voxel more or less moves H by.
        tau: threshold; None if there is none.
        normalised_tau: artanh(tau) / ||k||_1, the same threshold for H / ||k||_1.
        weight_sum: sum of the mixing weights; None without GENEOs.
        negative: names of the GENEOs with a negative weight.
    """

    kind: str
    measurement: Measurement
    kernels: tuple[Kernel, ...]
    translation_error: float
    quarter_turn_error: float
    kernel_turn_error: float
    half_voxel: Turn
    turns: tuple[Turn, ...]
    l1: float
    l1_bound: float
    measured: float
    measured_random: float
    measured_model: float
    answer_low: float
    answer_high: float
    one_voxel: float
    tau: float | None
    normalised_tau: float | None
    weight_sum: float | None
    negative: tuple[str, ...]

    @property
    def translates(self) -> bool:
        return self.translation_error <= ROUNDING

    @property
    def turns_by_quarters(self) -> bool:
        return self.quarter_turn_error <= ROUNDING

    @property
    def non_expansive(self) -> bool:
        """Whether H is, as it stands."""
        return self.l1 <= 1 + ROUNDING

    @property
    def convex(self) -> bool:
        """False too for a model without mixing weights."""
        if self.weight_sum is None:
            return False
        return not self.negative and abs(self.weight_sum - 1) <= CONVEX_ROUNDING

    def statements(self) -> list[Statement]:
        """What holds and what does not, to be read by a person."""
        statements = [
            self._translation(),
            self._quarter_turns(),
            self._any_turn(),
            self._expansion(),
            self._expansion_of_decisions(),
            self._expansion_of_model(),
        ]
        # A model without GENEOs has no kernels to say anything of.
        return [*statements, self._zero_sum(), self._convexity()] if self.kernels else statements

    def _translation(self) -> Statement:
        return Statement(
            "equivariant under translation by whole voxels",
            "4.1, Eq. 3.1",
            self.translates,
            f"largest difference of H {self.translation_error:.1e} of its largest value",
        )

    def _quarter_turns(self) -> Statement:
        return Statement(
            "equivariant under quarter turns about z",
            "4.4.1, Eq. 3.1",
            self.turns_by_quarters,
            f"largest difference of H {self.quarter_turn_error:.1e} of its largest value; the "
            f"kernel and its turned image differ by {self.kernel_turn_error:.1e} of its largest "
            "element",
        )

    def _any_turn(self) -> Statement:
        between = [t for t in self.turns if t.degrees is not None and t.degrees % 90]
        worst = max(between, key=lambda t: t.mean_h, default=None)
        text = "not measured" if worst is None else (
            f"at {worst.degrees:g} degrees, the worst, H differs by {worst.mean_h:.2f} of its "
            f"standard deviation and M by {worst.mean_m:.3f} on average; a shift by half a voxel, "
            f"which no kernel can do anything about, by {self.half_voxel.mean_h:.2f} and "
            f"{self.half_voxel.mean_m:.3f}"
        )  # fmt: skip
        return Statement("equivariant under any rotation about z", "4.4.1, Eq. 3.1", False, text)

    def _expansion(self) -> Statement:
        return Statement(
            "the observer H is non-expansive as it stands",
            "Eq. 3.2, 4.3",
            self.non_expansive,
            f"its constant is ||k||_1 = {self.l1:.3g}, at most {self.l1_bound:.3g} from the "
            f"kernels' own; {self.measured:.3g} was measured, and {self.measured_random:.3g} "
            f"between random scenes; one voxel moves it by at most {self.one_voxel:.3g}",
        )

    def _expansion_of_decisions(self) -> Statement:
        at = "" if self.normalised_tau is None else (
            f"; tau = {self.tau:.4g} is {self.normalised_tau:.4g} there"
        )  # fmt: skip
        return Statement(
            "decisions are those of a non-expansive operator",
            "Eq. 3.2, 4.3",
            self.l1 > 0,
            f"H / ||k||_1 has the constant 1 and is decided at artanh(tau) / ||k||_1{at}",
        )

    def _expansion_of_model(self) -> Statement:
        if self.measurement == "presence":
            return Statement(
                "the model M is non-expansive",
                "Eq. 3.2, 4.3",
                True,
                "different measurements are 1 apart and M lies in [0, 1], so that it would be with "
                f"any kernel; for values between, its constant is that of H, {self.l1:.3g}",
            )
        return Statement(
            "the model M is non-expansive",
            "Eq. 3.2, 4.3",
            self.non_expansive,
            f"its constant is that of H, {self.l1:.3g}; {self.measured_model:.3g} was measured",
        )

    def _zero_sum(self) -> Statement:
        balanced = [k.name for k in self.kernels if k.slice_sum <= ROUNDING * max(k.l1, 1)]
        others = [f"{k.name} {k.total:.3g}" for k in self.kernels if k.name not in balanced]
        return Statement(
            "zero-sum kernels sum to zero",
            "4.4.1, 4.4.2",
            all(k.name in balanced for k in self.kernels if k.sums_to_zero),
            f"sum to zero in every slice: {', '.join(balanced) or 'none'}; sums of the others: "
            f"{', '.join(others) or 'none'}; H lies in [{self.answer_low:.3g}, "
            f"{self.answer_high:.3g}] and not in [0, 1]",
        )

    def _convexity(self) -> Statement:
        weights = ", ".join(f"{k.name} {k.weight:.3f}" for k in self.kernels)
        shares = ", ".join(f"{k.name} {k.share:.3f}" for k in self.kernels)
        wrong = f"; negative: {', '.join(self.negative)}" if self.negative else ""
        return Statement(
            "convex combination of GENEOs",
            "Eq. 4.1, 4.5",
            self.convex,
            f"weights {weights}, together {self.weight_sum:.6f}{wrong}; among normalised kernels "
            f"{shares}",
        )


def certify(
    model: VoxelModel,
    points: np.ndarray | None = None,
    *,
    voxel_size: float = 1.0,
    measurement: Measurement = "presence",
    tau: float | None = None,
    angles: Sequence[float] = ANGLES_DEG,
    seed: int = 0,
) -> Certificate:
    """Measure and work out what a model keeps of the promises of a GENEO.

    Args:
        points: (N, 3) xyz, m, of a scene to measure on; a small synthetic one if None.
        voxel_size: m, of the grid that the scene is laid on.
        measurement: phi of the model's input.
        tau: the model's threshold, to count decisions that change.
        angles: degrees about z.
        seed: of the random measurements; ``measured_random`` alone depends on it.

    Raises:
        InputError: there are no points, or they are too far apart for the voxel size.
    """
    model = model.at(voxel_size)
    with torch.no_grad():
        kernel, bias = model.observer()
        k = kernel.detach().double()
        scene = Scene.of(sample_scene() if points is None else points, voxel_size, measurement)
        shifted, quarter = exact_errors(kernel, scene)
        half, turns = turns_of(model, scene, angles, tau)
        kernels, weight_sum, negative = _mixing(model)
        l1 = float(k.abs().sum())
        offset = 0.0 if bias is None else float(bias)
        return Certificate(
            kind=model.kind,
            measurement=measurement,
            kernels=kernels,
            translation_error=shifted,
            quarter_turn_error=quarter,
            kernel_turn_error=kernel_turn_error(k),
            half_voxel=half,
            turns=turns,
            l1=l1,
            l1_bound=sum(abs(g.weight) * g.l1 for g in kernels) if kernels else l1,
            measured=worst_pair(k),
            measured_random=random_pairs(k, seed),
            measured_model=worst_pair_of_model(k, offset),
            answer_low=float(k.clamp(max=0).sum()) + offset,
            answer_high=float(k.clamp(min=0).sum()) + offset,
            one_voxel=float(k.abs().max()),
            tau=tau,
            normalised_tau=None if tau is None or l1 == 0 else _observed(tau) / l1,
            weight_sum=weight_sum,
            negative=negative,
        )


def _mixing(model: VoxelModel) -> tuple[tuple[Kernel, ...], float | None, tuple[str, ...]]:
    """The kernels in numbers, the sum of the mixing weights, and who has a negative one."""
    if not isinstance(model, GeneoModel):
        return (), None, ()
    weights = model.mixing_weights().detach().double().tolist()
    sampled = model.kernels().detach().double()
    l1 = sampled.abs().sum(dim=(1, 2, 3)).tolist()
    total = sum(w * n for w, n in zip(weights, l1, strict=True)) or 1.0
    kernels = tuple(
        Kernel(
            name=name,
            weight=weight,
            l1=norm,
            largest=float(g.abs().max()),
            total=float(g.sum()),
            slice_sum=float(g.sum(dim=(1, 2)).abs().max()),
            sums_to_zero=kernel_named(geneo).sums_to_zero,
            share=weight * norm / total,
        )
        for name, geneo, weight, norm, g in zip(
            model.names, model.geneos, weights, l1, sampled, strict=True
        )
    )
    negative = tuple(k.name for k in kernels if k.weight < -CONVEX_ROUNDING)
    return kernels, sum(weights), negative


def _observed(tau: float) -> float:
    """What the observer answers where the model's probability is tau."""
    return math.atanh(min(tau, 1 - 1e-16))
