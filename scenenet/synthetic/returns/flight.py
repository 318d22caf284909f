"""The flight of the helicopter along a section, and its scan lines over a stretch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenenet.synthetic.scene.line import FLIGHT
from scenenet.synthetic.scene.random_fields import stream
from scenenet.synthetic.settings import SyntheticSettings


@dataclass(frozen=True)
class Flight:
    """One flight; these numbers are constant for a section of the line.

    Attributes:
        number: 0, 1, ... along the line.
        height: above the ground, m.
        offset: distance from the line, m; left is positive. The helicopter flies next to the line
            and sees crowns and roofs from there.
        line_step: distance between two scan lines, m.
        pulse_step: distance between two pulses of a scan line, m.
        skew: how far a scan line advances while it crosses the corridor, m per m.
        sway: amplitude of the variation of scan lines along the line, m.
        conductors: share of the scan lines that give a point on a conductor.
        solids: density of points on towers, over that of the settings.
        strays: density of stray returns, over that of the settings.
        depths: stray returns deep in the crowns, over their mean.
        passes: (start, end) of each pass across the corridor, m; a second one overlaps the first.
    """

    number: int
    height: float
    offset: float
    line_step: float
    pulse_step: float
    skew: float
    sway: float
    conductors: float
    solids: float
    strays: float
    depths: float
    passes: tuple[tuple[float, float], ...]

    @property
    def on_line(self) -> int:
        """Number of passes that scan the line itself."""
        return sum(start < 0.0 < end for start, end in self.passes)


def flight_of(settings: SyntheticSettings, number: int) -> Flight:
    """Flight ``number`` of a survey."""
    rng = stream(settings.seed, FLIGHT, number)
    height = rng.uniform(*settings.flight_height)
    density = settings.density * np.exp(np.clip(0.13 * rng.standard_normal(), -0.3, 0.3))
    # A faster flight has scan lines that are further apart, relative to the pulses of one line.
    shape = np.exp(rng.uniform(-0.15, 0.45))
    cell = 1 / np.sqrt(density)
    width = settings.half_width
    passes = [(-width, width)]
    if rng.random() < min(1.0, 2 * settings.swath_overlap):
        side = rng.choice((-1.0, 1.0))
        edge = rng.uniform(-width, width)
        passes.append((edge, width) if side > 0 else (-width, edge))
    return Flight(
        number=number,
        height=float(height),
        offset=float(rng.choice((-1, 1)) * rng.uniform(7.0, 10.5) * min(1.0, width / 12.0)),
        line_step=float(cell * np.sqrt(shape)),
        pulse_step=float(cell / np.sqrt(shape)),
        skew=float(rng.uniform(-0.25, 0.25)),
        sway=float(rng.uniform(0.0, 0.12)),
        conductors=float(np.clip(settings.wire_returns * rng.uniform(0.35, 1.35), 0, 1)),
        solids=float(np.exp(np.clip(0.35 * rng.standard_normal(), -0.35, 0.6))),
        strays=float(np.exp(np.clip(0.6 * rng.standard_normal(), -1.2, 1.2))),
        depths=float(np.exp(np.clip(0.8 * rng.standard_normal(), -2.0, 1.2))),
        passes=tuple((float(a), float(b)) for a, b in passes),
    )
