"""What holds for the operators of kernels with a direction (docs/method/observers.md).

A turn by an angle of the orbit permutes its kernels, to rounding; ``own`` measures by how much it
does not. Between two angles of the orbit no kernel points along the pattern; ``between`` measures
what the operator loses there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from scenenet.models.geneo_model import GeneoModel


@dataclass(frozen=True)
class OrbitFacts:
    """The measured properties of the operator of a GENEO with a direction.

    Attributes:
        name: of the GENEO.
        turns: number of turns about z in its orbit.
        slopes: number of slopes.
        own: largest difference between the orbit that is turned by one of its own angles and the
            orbit itself, as a share of the largest element.
        between: by how much the response to a pattern, the kernel itself, falls when the pattern is
            turned by half an angle of the orbit, as a share of the response.
        l1: the largest ||g||_1 of its kernels, the constant of the operator (Eq. 3.2).
    """

    name: str
    turns: int
    slopes: int
    own: float
    between: float
    l1: float


def orbit_facts(model: GeneoModel) -> tuple[OrbitFacts, ...]:
    """The properties of each GENEO of a model and of its first observers that has a direction."""
    found = []
    for prefix, stage in model.stages():
        for name in stage.names:
            if stage.kernel_of(name).oriented:
                found.append(_facts(stage, name, f"{prefix}{name}"))
    return tuple(found)


def _facts(model: GeneoModel, name: str, label: str) -> OrbitFacts:
    kernel = model.kernel_of(name)
    angle = 2 * math.pi / kernel.turns
    with torch.no_grad():
        orbit = model.orbit_of(name).double()
        turned = model.orbit_of(name, angle).double()
        halfway = model.orbit_of(name, angle / 2).double()
    permuted = torch.roll(orbit, -len(kernel.slopes), 0)
    largest = float(orbit.abs().max()) or 1.0
    aligned = _response(orbit, orbit[0])
    beside = _response(orbit, halfway[0])
    return OrbitFacts(
        label,
        kernel.turns,
        len(kernel.slopes),
        float((turned - permuted).abs().max()) / largest,
        1 - beside / aligned if aligned else 0.0,
        float(orbit.abs().sum(dim=(1, 2, 3)).max()),
    )


def _response(orbit: Tensor, pattern: Tensor) -> float:
    """The largest response of an orbit (n, kz, ky, kx) to a pattern (kz, ky, kx) in its middle."""
    return float((orbit * pattern.abs()).sum(dim=(1, 2, 3)).abs().max())
