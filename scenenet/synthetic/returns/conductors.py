"""Returns from conductors, earth wires and the cables of other lines."""

from __future__ import annotations

import numpy as np

from scenenet.line.catenary import Catenary
from scenenet.synthetic.codes import CONDUCTOR, TALL
from scenenet.synthetic.returns.flight import Flight
from scenenet.synthetic.scene.line import Support
from scenenet.synthetic.scene.random_fields import Raster
from scenenet.synthetic.scene.strip import Strip
from scenenet.synthetic.scene.tension import ASIDE_M, jumper
from scenenet.synthetic.settings import SyntheticSettings

BUNDLE_M = 0.4
"""Distance between the subconductors of a bundle, m."""

CABLE_SAG = 0.02
"""Sag of the cables of other lines as a share of their span."""


def string_conductors(
    starts: np.ndarray,
    ends: np.ndarray,
    parameter: float,
    step: float,
    share: float,
    rng: np.random.Generator,
    window: tuple[float, float] = (0.0, 1.0),
) -> np.ndarray:
    """Points (N, 3) of the conductors from ``starts`` to ``ends`` (W, 3), where scan lines cross
    them.

    Args:
        parameter: of the catenary, m.
        step: distance between two scan lines, m.
        share: share of the scan lines that give a point.
        window: part that is scanned, as shares of the horizontal distance.
    """
    points = []
    for start, end in zip(starts, ends, strict=True):
        length = max(float(np.hypot(*(end - start)[:2])), step)
        at = np.arange(window[0] * length, window[1] * length, step)
        at = at[rng.random(len(at)) < share]
        at = at + 0.2 * step * rng.standard_normal(len(at))
        u = np.clip(at / length, *window)
        points.append(Catenary.of(start, end, parameter).at_shares(u))
    return np.concatenate(points)


def bundled(attachments: np.ndarray, azimuth: float, bundle: int, conductors: int) -> np.ndarray:
    """The ends (V, 3), m, of all wires at ``attachments`` (W, 3): the first ``conductors`` of them
    hold bundles of ``bundle`` subconductors, next to and below each other."""
    if bundle == 1:
        return attachments
    right = np.array([np.sin(azimuth), -np.cos(azimuth), 0.0])
    half = BUNDLE_M / 2
    places = {
        2: [(-half, 0.0), (half, 0.0)],
        3: [(-half, 0.0), (half, 0.0), (0.0, -BUNDLE_M)],
        4: [(-half, 0.0), (half, 0.0), (-half, -BUNDLE_M), (half, -BUNDLE_M)],
    }[bundle]
    ends = [
        attachment + across * right + np.array([0.0, 0.0, down])
        for attachment in attachments[:conductors] for across, down in places
    ]  # fmt: skip
    return np.array([*ends, *attachments[conductors:]])


def middles(attachments: np.ndarray, azimuth: float, bundle: int, conductors: int) -> np.ndarray:
    """(W, 3) m, the middle between the highest, lowest, leftmost and rightmost ends of each bundle
    of ``bundled``."""
    ends = bundled(attachments, azimuth, bundle, conductors)
    bundles = ends[: conductors * bundle].reshape(conductors, bundle, 3)
    middle = (bundles.min(axis=1) + bundles.max(axis=1)) / 2
    return np.concatenate((middle, ends[conductors * bundle :]))


def conductor_points(
    strip: Strip,
    before: Support,
    after: Support,
    span: float,
    flight: Flight,
    settings: SyntheticSettings,
    rng: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) and class codes (N,) of the conductors and earth wires of the line in a
    strip."""
    conductors = 3 * settings.circuits
    starts = bundled(before.ahead, before.azimuth, settings.bundle, conductors)
    ends = bundled(after.behind, after.azimuth, settings.bundle, conductors)
    window = (strip.low / span, strip.high / span)
    points = string_conductors(
        starts,
        ends,
        settings.catenary,
        flight.line_step / flight.on_line,
        flight.conductors,
        rng,
        window,
    )
    points += 0.7 * settings.ranging_noise * rng.standard_normal(points.shape)
    return points, np.full(len(points), CONDUCTOR, np.uint8)


def jumper_points(
    tower: Support, flight: Flight, settings: SyntheticSettings, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) and class codes (N,) of the jumpers of a tension tower."""
    conductors = 3 * settings.circuits
    behind, ahead = (
        bundled(ends[:conductors], tower.azimuth, settings.bundle, conductors)
        for ends in (tower.behind, tower.ahead)
    )
    step = flight.line_step / flight.on_line
    parts = []
    for start, end in zip(behind, ahead, strict=True):
        middle = (start + end)[:2] / 2
        in_the_way = np.hypot(*(middle - (tower.x, tower.y))) < ASIDE_M
        curve = jumper(start, end, bool(in_the_way))
        # Scan lines cross the loop at steps of its length, not of its plan.
        hung = curve.at_shares(np.linspace(0, 1, 50))
        along = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(hung, axis=0), axis=1))]
        at = np.arange(rng.uniform(0, step), along[-1], step)
        at = at[rng.random(len(at)) < flight.conductors]
        parts.append(curve.at_shares(np.interp(at, along, np.linspace(0, 1, 50))))
    points = np.concatenate(parts)
    points += 0.7 * settings.ranging_noise * rng.standard_normal(points.shape)
    return points, np.full(len(points), CONDUCTOR, np.uint8)


def other_cables(
    strip: Strip,
    terrain: Raster,
    flight: Flight,
    settings: SyntheticSettings,
    rng: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) and class codes (N,) of low cables: telephone, street lights, houses.

    Annotators labelled the main line only: other cables are in class 12, like everything tall.
    """
    count = rng.poisson(settings.other_lines * (strip.high - strip.low) / 1000.0)
    parts = [np.empty((0, 3))]
    for _ in range(count):
        s = rng.uniform(strip.low, strip.high)
        t = rng.uniform(-strip.half_width, strip.half_width)
        azimuth = strip.azimuth + rng.uniform(0, np.pi)
        half = rng.uniform(15.0, 25.0)
        x, y = strip.to_map(s, t)
        ends = np.array([[x, y], [x, y]]) + half * np.array([[-1], [1]]) * [
            np.cos(azimuth), np.sin(azimuth)
        ]  # fmt: skip
        # The ground is known near the strip only; beyond it the cable has a random slope.
        z0 = float(terrain.bilinear(np.array([x]), np.array([y]))[0])
        height = rng.uniform(4.5, 8.5)
        tilt = rng.uniform(-0.08, 0.08) * half
        starts = np.column_stack((ends, [z0 + height - tilt, z0 + height + tilt]))
        parameter = 2 * half / (8 * CABLE_SAG)
        for down in (0.0, 0.35)[: rng.integers(1, 3)]:
            hung = starts - [0, 0, down]
            parts.append(
                string_conductors(
                    hung[:1], hung[1:], parameter, flight.line_step, flight.conductors, rng
                )
            )
    points = np.concatenate(parts)
    points = points[strip.holds(points[:, 0], points[:, 1])]
    points += 0.7 * settings.ranging_noise * rng.standard_normal(points.shape)
    return points, np.full(len(points), TALL, np.uint8)
