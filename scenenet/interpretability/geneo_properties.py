"""Which GENEO properties a given model has (thesis 3.4, 4.3 to 4.5), calculated and measured.

A GENEO is equivariant (Eq. 3.1) and non-expansive (Eq. 3.2), and a convex combination of GENEOs is
a GENEO. The thesis states this for functions on R^3 and normalised kernels. A model uses kernels
that are cut to a box of voxels and not normalised, so each property is verified here.

**Translation** by whole voxels: exact, also at the border, because everything outside the grid is
empty. Translation by part of a voxel is not exact, because points change voxels.

**Quarter turns about z**: exact if a quarter turn about the anchor leaves the kernel unchanged,
which needs ky = kx and an odd size. A free kernel (the CNN) does not have this symmetry.

**Other angles about z**: not exact, because points change voxels and the kernel's box has corners.
A shift by half a voxel also makes points change voxels, so its effect is measured for comparison.

**Non-expansivity**, in the sup norm. The smallest constant of H = k * phi is ||k||_1, the sum of
|k|; two measurements that differ by one with the sign of k attain it. This also holds for a kernel
that sums to zero: its responses range from -||k||_1 / 2 to ||k||_1 / 2. With hundreds of elements
||k||_1 is far above 1, so neither H itself nor its kernels g_i are non-expansive. What holds:

- H / ||k||_1 is non-expansive, and M >= tau is the same as H / ||k||_1 >= artanh(tau) / ||k||_1:
  the decisions are those of a non-expansive operator.
- tanh and ReLU do not increase the constant, and near H = 0 they do not lower it: for phi in [0, 1]
  (density) the constant of M = (tanh H)_+ is ||k||_1 too. For phi in {0, 1} (presence) two
  measurements differ by 0 or 1 and M lies in [0, 1], so (3.2) holds for M with any kernel.
- One voxel more or less changes H at each position by one element of k, at most by max |k|.

**Convexity**: the mixing weights sum to one and none is negative; otherwise the model is not
convex. For normalised kernels g_i / ||g_i||_1 the weights are
lambda_i ||g_i||_1 / sum_j lambda_j ||g_j||_1, which are convex if the lambda_i are: H is a convex
combination of GENEOs times a positive number.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import torch

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
"""Measured rotations about z, degrees."""
ROUNDING = 1e-4
"""Largest error, as a share of max |H|, that counts as rounding: sums of hundreds of float32 terms
in another order."""
CONVEX_ROUNDING = 1e-5
"""Largest rounding error of mixing weights in float32."""


@dataclass(frozen=True)
class Kernel:
    """The properties of one kernel g.

    Attributes:
        name: of the GENEO.
        weight: lambda, its mixing weight.
        l1: ||g||_1, its non-expansivity constant.
        largest: max |g|.
        total: sum of g.
        slice_sum: the largest |sum| of a horizontal slice.
        sums_to_zero: whether each slice sums to zero by design (thesis 4.4.1, 4.4.2).
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
    """The properties of one model; see the docstring of this module.

    Attributes:
        kind: architecture.
        measurement: phi of its input.
        kernels: of a SCENE-Net; empty for a model without GENEOs.
        translation_error: largest |difference| of H under ``SHIFT``, as a share of max |H|.
        quarter_turn_error: the same for the worst of three quarter turns.
        kernel_turn_error: max |k - k after a quarter turn| as a share of max |k|, the cause of
            ``quarter_turn_error``.
        half_voxel: differences after a shift by half a voxel along x and y.
        turns: differences after rotations about z.
        l1: ||k||_1 of the summed kernel, the smallest constant of H in the sup norm.
        l1_bound: sum of |lambda_i| ||g_i||_1, which l1 never exceeds; l1 itself without GENEOs.
        measured: |H_1 - H_2| / |phi_1 - phi_2| of the worst pair, measured with the convolution.
        measured_random: the largest such value between random measurements in {0, 1}.
        measured_model: the same for M, for the worst pair with a difference of at most 0.001.
        lowest_h, highest_h: smallest and largest possible H for phi in [0, 1].
        one_voxel: max |k|, the largest change of H by a single voxel.
        tau: threshold; None before tuning.
        normalised_tau: artanh(tau) / ||k||_1, the same threshold for H / ||k||_1.
        weight_sum: sum of the mixing weights; None without GENEOs.
        negative: names of the GENEOs with a negative weight.
    """

    kind: str
    measurement: str
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
    lowest_h: float
    highest_h: float
    one_voxel: float
    tau: float | None
    normalised_tau: float | None
    weight_sum: float | None
    negative: tuple[str, ...]

    @property
    def translates(self) -> bool:
        """Whether H is equivariant under translation by whole voxels."""
        return self.translation_error <= ROUNDING

    @property
    def turns_by_quarters(self) -> bool:
        """Whether H is equivariant under quarter turns about z."""
        return self.quarter_turn_error <= ROUNDING

    @property
    def non_expansive(self) -> bool:
        """Whether H itself is non-expansive."""
        return self.l1 <= 1 + ROUNDING

    @property
    def convex(self) -> bool:
        """Whether the mixing weights are convex; False for a model without mixing weights."""
        if self.weight_sum is None:
            return False
        return not self.negative and abs(self.weight_sum - 1) <= CONVEX_ROUNDING

    def statements(self) -> list[Statement]:
        """Which properties hold and which do not, in words."""
        statements = [
            self._translation(),
            self._quarter_turns(),
            self._any_turn(),
            self._expansion(),
            self._expansion_of_decisions(),
            self._expansion_of_model(),
        ]
        # The last two properties are about GENEOs.
        return [*statements, self._zero_sum(), self._convexity()] if self.kernels else statements

    def _translation(self) -> Statement:
        return Statement(
            "equivariant under translation by whole voxels",
            "4.1, Eq. 3.1",
            self.translates,
            f"H differs by at most {self.translation_error:.1e} of its largest value",
        )

    def _quarter_turns(self) -> Statement:
        return Statement(
            "equivariant under quarter turns about z",
            "4.4.1, Eq. 3.1",
            self.turns_by_quarters,
            f"H differs by at most {self.quarter_turn_error:.1e} of its largest value; the kernel "
            f"differs from its turned image by {self.kernel_turn_error:.1e} of its largest element",
        )

    def _any_turn(self) -> Statement:
        between = [t for t in self.turns if t.degrees is not None and t.degrees % 90]
        worst = max(between, key=lambda t: t.mean_h, default=None)
        text = "not measured" if worst is None else (
            f"at the worst angle, {worst.degrees:g} degrees, H differs on average by "
            f"{worst.mean_h:.2f} of its standard deviation and M by {worst.mean_m:.3f}; after a "
            f"shift by half a voxel, which no kernel can compensate, by "
            f"{self.half_voxel.mean_h:.2f} and {self.half_voxel.mean_m:.3f}"
        )  # fmt: skip
        return Statement("equivariant under any rotation about z", "4.4.1, Eq. 3.1", False, text)

    def _expansion(self) -> Statement:
        return Statement(
            "the observer H is non-expansive without scaling",
            "Eq. 3.2, 4.3",
            self.non_expansive,
            f"its constant is ||k||_1 = {self.l1:.3g}, with the bound {self.l1_bound:.3g} from the "
            f"constants of the kernels; measured: {self.measured:.3g}, and "
            f"{self.measured_random:.3g} between random scenes; one voxel changes H by at most "
            f"{self.one_voxel:.3g}",
        )

    def _expansion_of_decisions(self) -> Statement:
        at = "" if self.normalised_tau is None else (
            f"; for tau = {self.tau:.4g} that is {self.normalised_tau:.4g}"
        )  # fmt: skip
        return Statement(
            "decisions are those of a non-expansive operator",
            "Eq. 3.2, 4.3",
            self.l1 > 0,
            f"H / ||k||_1 has the constant 1 and the threshold artanh(tau) / ||k||_1{at}",
        )

    def _expansion_of_model(self) -> Statement:
        if self.measurement == "presence":
            return Statement(
                "the model M is non-expansive",
                "Eq. 3.2, 4.3",
                True,
                "different measurements differ by 1 and M lies in [0, 1], so this holds with any "
                f"kernel; for measurements between 0 and 1 the constant would be that of H, "
                f"{self.l1:.3g}",
            )
        return Statement(
            "the model M is non-expansive",
            "Eq. 3.2, 4.3",
            self.non_expansive,
            f"its constant is that of H, {self.l1:.3g}; measured: {self.measured_model:.3g}",
        )

    def _zero_sum(self) -> Statement:
        balanced = [k.name for k in self.kernels if k.slice_sum <= ROUNDING * max(k.l1, 1)]
        others = [f"{k.name} {k.total:.3g}" for k in self.kernels if k.name not in balanced]
        return Statement(
            "zero-sum kernels sum to zero",
            "4.4.1, 4.4.2",
            all(k.name in balanced for k in self.kernels if k.sums_to_zero),
            f"kernels that sum to zero in every slice: {', '.join(balanced) or 'none'}; sums of "
            f"the others: {', '.join(others) or 'none'}; H lies in [{self.lowest_h:.3g}, "
            f"{self.highest_h:.3g}] and not in [0, 1]",
        )

    def _convexity(self) -> Statement:
        weights = ", ".join(f"{k.name} {k.weight:.3f}" for k in self.kernels)
        shares = ", ".join(f"{k.name} {k.share:.3f}" for k in self.kernels)
        wrong = f"; negative: {', '.join(self.negative)}" if self.negative else ""
        return Statement(
            "convex combination of GENEOs",
            "Eq. 4.1, 4.5",
            self.convex,
            f"weights {weights}; sum {self.weight_sum:.6f}{wrong}; weights of normalised kernels "
            f"{shares}",
        )


def certify(
    model: VoxelModel,
    points: np.ndarray | None = None,
    *,
    voxel_size: float = 1.0,
    measurement: str = "presence",
    tau: float | None = None,
    angles: Sequence[float] = ANGLES_DEG,
    seed: int = 0,
) -> Certificate:
    """Verify which GENEO properties a model has.

    Args:
        points: (N, 3) xyz, m, of the scene to measure with; a small synthetic one if None.
        voxel_size: m, of the grid of the scene.
        measurement: phi of the model's input.
        tau: the model's threshold, to count decisions that change.
        angles: degrees about z.
        seed: of the random measurements; only ``measured_random`` depends on it.

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
            lowest_h=float(k.clamp(max=0).sum()) + offset,
            highest_h=float(k.clamp(min=0).sum()) + offset,
            one_voxel=float(k.abs().max()),
            tau=tau,
            normalised_tau=None if tau is None or l1 == 0 else _observed(tau) / l1,
            weight_sum=weight_sum,
            negative=negative,
        )


def _mixing(model: VoxelModel) -> tuple[tuple[Kernel, ...], float | None, tuple[str, ...]]:
    """The kernels, the sum of the mixing weights, and the names of the negative ones."""
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
    """The observer's H at which the model's probability is tau."""
    return math.atanh(min(tau, 1 - 1e-16))
