"""A conductor: long, thin and nearly level, in any direction."""

from __future__ import annotations

from collections.abc import Mapping

import torch
from torch import Tensor

from scenenet.geneo.kernel import Extent, GeneoKernel, ShapeParameter
from scenenet.geneo.lattice import Lattice
from scenenet.geneo.registry import register
from scenenet.geneo.sentences import Numbers, Reference, m

CUT = 3.0
"""Standard deviations from its axis beyond which the line is cut off."""


def _length(n: Numbers, reference: Reference) -> str:
    return f"a straight line that starts at the voxel and is {m(abs(n['l']))} long responds fully"


def _thickness(n: Numbers, reference: Reference) -> str:
    return f"points within {m(abs(n['r']))} of the line have more than 60 % of the highest weight"


@register
class Line(GeneoKernel):
    """g(x) = exp(-(y^2 + z^2) / (2 s^2)) / l where 0 <= x <= l, with l in voxels.

    s^2 = r^2 + a^2 / 6 includes the extent of a voxel of edge a, in which a point may lie anywhere.
    The response is the occupied share of a line that begins at the voxel. It begins there, and does
    not pass through it, because conductors end at towers and at the edge of a survey.
    """

    name = "line"
    adds_up_height = False
    turns = 32
    slopes = (-0.36, -0.24, -0.12, 0.0, 0.12, 0.24, 0.36)
    parameters = (
        ShapeParameter(
            "l",
            8.0,
            24.0,
            "voxel",
            "length of a conductor that a voxel must be the end of",
            metric=(4.0, 12.0),
            sentence=_length,
            # Longer than a crossarm, and shorter than what a crop holds of a span.
            fixed=10.0,
        ),
        ShapeParameter(
            "r",
            0.1,
            1.0,
            "voxel",
            "deviation of a conductor from a straight line",
            metric=(0.05, 0.8),
            sentence=_thickness,
            # A bundle of conductors, and the sag over 10 m.
            fixed=0.45,
        ),
    )

    def sample(self, lattice: Lattice, shape: Mapping[str, Tensor]) -> Tensor:
        length, step = shape["l"], lattice.step
        spread = shape["r"].square() + step**2 / 6
        ends = torch.minimum(lattice.x + step, length - lattice.x + 0 * lattice.x)
        along = (ends / step + 0.5).clamp(0, 1)
        aside = lattice.y.square() + lattice.z.square()
        line = along * torch.exp(-aside / (2 * spread)) * (aside <= CUT**2 * spread)
        return line * (step / (length + step))

    def extent(self, shape: Mapping[str, float]) -> Extent:
        rise = max(map(abs, self.slopes)) * shape["l"] + CUT * shape["r"]
        return Extent(rise, rise, shape["l"] + CUT * shape["r"])
