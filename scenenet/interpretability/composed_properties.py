"""Which GENEO properties a model has that is not one kernel: with orbits, or a first observer
(docs/method/observers.md). Each is calculated or measured, as for other models
(``scenenet.interpretability.geneo_properties``).

**Equivariance.** Translations by whole voxels and quarter turns are measured with the model itself.
Turns by other angles of an orbit are exact for its kernels (``scenenet.interpretability.orbits``).
On a scene they are not, because points change voxels; the certificate says by how much.

**Non-expansivity.** The constant of an orbit is the largest ||g||_1 of its kernels, that of a
convex combination is at most the combination of the constants, and that of a composition at most
their product. The largest constant that was measured, between random measurements in [0, 1] and
small changes of them, is compared with this bound and never exceeds it.

**Convexity.** The mixing weights of each observer sum to one and none is negative. A maximum or a
product of operators is not a convex combination; what bounds its constant is in
``scenenet.models.mixing``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

from scenenet.convolution.occupancy import Occupancy
from scenenet.interpretability.equivariance import Scene, measured_errors, observed_by, turns_of
from scenenet.interpretability.orbits import OrbitFacts, orbit_facts
from scenenet.interpretability.result import Statement, Turn
from scenenet.models.geneo_model import GeneoModel
from scenenet.models.mixing import constant
from scenenet.models.settings import Mixing

ROUNDING = 1e-4
"""Largest error, as a share of max |H|, that counts as rounding."""
CONVEX_ROUNDING = 1e-5
"""Largest rounding error of mixing weights in float32."""
PAIRS = 12
"""Pairs of measurements between which the constant is measured."""


@dataclass(frozen=True)
class StageFacts:
    """The properties of one observer.

    Attributes:
        name: "first observer" or "observer".
        weights: mixing weight of each GENEO, by name.
        constant: a bound of its constant (Eq. 3.2), from lambda ||g||_1 of each GENEO; that of
            (tanh H)+ for a product.
        mixing: how its GENEOs become one.
    """

    name: str
    weights: dict[str, float]
    constant: float
    mixing: Mixing = "convex"


@dataclass(frozen=True)
class ComposedCertificate:
    """The properties of one model; see the docstring of this module.

    Attributes:
        kind: architecture.
        measurement: phi of its input.
        translation_error, quarter_turn_error: largest |difference| of H, as a share of max |H|.
        half_voxel: differences after a shift by half a voxel along x and y.
        turns: differences after rotations about z.
        orbits: of its kernels with a direction.
        stages: the first observer, if there is one, and the observer.
        l1_bound: product of the constants of the stages.
        measured: the largest |H_1 - H_2| / |phi_1 - phi_2| between measurements, in the sup norm;
            of (tanh H)+ for a product.
        tau: threshold; None before tuning.
    """

    kind: str
    measurement: str
    translation_error: float
    quarter_turn_error: float
    half_voxel: Turn
    turns: tuple[Turn, ...]
    orbits: tuple[OrbitFacts, ...]
    stages: tuple[StageFacts, ...]
    l1_bound: float
    measured: float
    tau: float | None

    def statements(self) -> list[Statement]:
        """Which properties hold and which do not, in words."""
        return [
            Statement(
                "equivariant under translation by whole voxels",
                "4.1, Eq. 3.1",
                self.translation_error <= ROUNDING,
                f"H differs by at most {self.translation_error:.1e} of its largest value",
                self.translation_error,
            ),
            Statement(
                "equivariant under quarter turns about z",
                "4.4.1, Eq. 3.1",
                self.quarter_turn_error <= ROUNDING,
                f"H differs by at most {self.quarter_turn_error:.1e} of its largest value",
                self.quarter_turn_error,
            ),
            *(_of_orbit(orbit) for orbit in self.orbits),
            self._any_turn(),
            Statement(
                f"the {self._bounded} is non-expansive without scaling",
                "Eq. 3.2, 4.3",
                self.l1_bound <= 1 + ROUNDING,
                f"its constant is at most {self.l1_bound:.3g}, the product of the constants of its "
                f"observers ({', '.join(f'{s.name} {s.constant:.3g}' for s in self.stages)}); "
                f"measured: {self.measured:.3g}",
                self.l1_bound,
            ),
            *(_convexity(stage) for stage in self.stages),
        ]

    @property
    def _bounded(self) -> str:
        product = any(stage.mixing == "product" for stage in self.stages)
        return "model M" if product else "observer H"

    def _any_turn(self) -> Statement:
        between = [t for t in self.turns if t.degrees is not None and t.degrees % 90]
        worst = max(between, key=lambda t: t.mean_h)
        text = (
            f"at the worst angle, {worst.degrees:g} degrees, H differs on average by "
            f"{worst.mean_h:.2f} of its standard deviation; after a shift by half a voxel, which "
            f"no kernel can compensate, by {self.half_voxel.mean_h:.2f}"
        )
        return Statement(
            "equivariant under any rotation about z", "4.4.1, Eq. 3.1", False, text, worst.mean_h
        )


def certify_composed(
    model: GeneoModel,
    scene: Scene,
    angles: Sequence[float],
    tau: float | None,
    seed: int,
) -> ComposedCertificate:
    """Verify which GENEO properties a model has that is not one kernel.

    Args:
        model: at the voxel size of the scene.
        angles: degrees about z.
        seed: of the random measurements; only ``measured`` depends on it.
    """
    with torch.no_grad():
        shifted, quarter = measured_errors(model, scene)
        half, turns = turns_of(model, scene, angles, tau)
        stages = tuple(_stage(prefix, stage) for prefix, stage in model.stages())
        return ComposedCertificate(
            kind=model.kind,
            measurement=scene.measurement,
            translation_error=shifted,
            quarter_turn_error=quarter,
            half_voxel=half,
            turns=turns,
            orbits=orbit_facts(model),
            stages=stages[::-1],
            l1_bound=float(np.prod([stage.constant for stage in stages])),
            measured=_measured_constant(model, seed),
            tau=tau,
        )


def _stage(prefix: str, model: GeneoModel) -> StageFacts:
    weights = model.mixing_weights().double().tolist()
    norms = [float(orbit.double().abs().sum(dim=(1, 2, 3)).max()) for orbit in model.orbits()]
    bound = constant([abs(w) * norm for w, norm in zip(weights, norms, strict=True)], model.mixes)
    name = "first observer" if prefix else "observer"
    return StageFacts(name, dict(zip(model.names, weights, strict=True)), bound, model.mixes)


def _measured_constant(model: GeneoModel, seed: int) -> float:
    """The largest |H_1 - H_2| / |phi_1 - phi_2|, or that of (tanh H)+ for a product of operators,
    between random measurements and small changes of them, in a window as wide as the reach of the
    model, whose middle the whole window influences.

    The voxels are those of both measurements, because the model answers at occupied ones.
    """
    rng = np.random.default_rng(seed)
    reach = model.reach
    shape = (2 * reach[0] + 1, 2 * reach[1] + 1, 2 * reach[2] + 1)
    observe, found = observed_by(model), 0.0
    for n in range(PAIRS):
        share = (0.002, 0.02, 0.2)[n % 3]
        index = np.flatnonzero(rng.random(shape) < share)
        before = rng.uniform(0.1, 0.9, len(index)).astype(np.float32)
        step = np.float32(0.05)
        after = before + step * np.sign(rng.normal(size=len(index))).astype(np.float32)
        one, other = (observe(Occupancy.of_grids([index], [phi], shape)) for phi in (before, after))
        if model.mixes == "product":
            one, other = (torch.relu(torch.tanh(h)) for h in (one, other))
        found = max(found, float((one - other).abs().max()) / float(step))
    return found


def _of_orbit(orbit: OrbitFacts) -> Statement:
    return Statement(
        f"{orbit.name}: its {orbit.turns} turns are permuted by a turn of the scene",
        "Eq. 3.1",
        orbit.own <= ROUNDING,
        f"the kernels differ by at most {orbit.own:.1e} of the largest element after a turn by "
        f"{360 / orbit.turns:g} degrees; a pattern halfway between two turns gets "
        f"{orbit.between:.0%} less; its constant is {orbit.l1:.3g}",
        orbit.own,
    )


def _convexity(stage: StageFacts) -> Statement:
    total, negative = sum(stage.weights.values()), [n for n, w in stage.weights.items() if w < 0]
    weights = ", ".join(f"{name} {weight:.3f}" for name, weight in stage.weights.items())
    wrong = f"; negative: {', '.join(negative)}" if negative else ""
    if stage.mixing != "convex":
        return Statement(
            f"{stage.name}: convex combination of GENEOs",
            "Eq. 4.1, 4.5",
            False,
            f"it is the {stage.mixing} of its GENEOs, with weights {weights}{wrong}",
            total,
        )
    return Statement(
        f"{stage.name}: convex combination of GENEOs",
        "Eq. 4.1, 4.5",
        not negative and abs(total - 1) <= CONVEX_ROUNDING,
        f"weights {weights}; sum {total:.6f}{wrong}",
        total,
    )
