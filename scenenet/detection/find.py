"""Towers of a survey: candidates from voxels, measured and decided in points."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scenenet.core.progress import labelled, track_if
from scenenet.detection.bends import pass_without_bend
from scenenet.detection.candidates import SURROUNDINGS_M
from scenenet.detection.conductor_rules import (
    FAR,
    FURTHEST_M,
    HEAD,
    POLE_M,
    WIDE,
    WIDEST_HEAD_M,
)
from scenenet.detection.conductors import ConductorPoints, Span
from scenenet.detection.detected_voxels import DetectedSurvey
from scenenet.detection.distinct import distinct_towers, same_axis
from scenenet.detection.following import leads_on
from scenenet.detection.measure_structure import measure_structure
from scenenet.detection.measured_tower import MeasuredTower
from scenenet.detection.rough import RoughTower, rough_towers
from scenenet.detection.settings import DetectionSettings
from scenenet.detection.structure import BodyTests, Structure
from scenenet.detection.surroundings import Surroundings

MIN_FREE = 1 / 3
"""Smallest share of the levels at which the body stands free, by points."""

AHEAD = 6
"""Number of rough towers ahead of the one that is measured at which conductors are looked for."""


def find_towers(
    detected: DetectedSurvey,
    surroundings: Surroundings,
    points: Surroundings,
    tau: float,
    settings: DetectionSettings,
    progress: str | None = None,
    *,
    bent: bool = True,
) -> list[MeasuredTower]:
    """Find the towers among detected voxels and measure each in points, highest probability first.

    Voxels give approximate axes (``scenenet.detection.rough``). The points around an axis then
    decide, so that the result hardly depends on where the borders of the voxels lie.

    Args:
        detected: the voxels with probability >= ``settings.threshold(tau)``.
        surroundings: gives the occupied voxels around a position.
        points: gives the points around a position.
        tau: threshold of the model.
        progress: start of the labels of the progress on stderr; None shows no progress.
        bent: whether what conductors pass without a bend is no tower.
    """
    offset, voxel_size = detected.offset, detected.voxel_size
    rough = rough_towers(detected, surroundings, settings, progress)
    conductors = ConductorPoints(points, HEAD * settings.min_height)
    measurement = _Measurement(
        surroundings, points, conductors, offset, voxel_size, tau, settings, bent
    )
    found: list[MeasuredTower] = []
    for coming in rough[: AHEAD - 1]:
        measurement.expect(coming)
    for i in track_if(range(len(rough)), labelled(progress, "candidates measured")):
        for coming in rough[i + AHEAD - 1 : i + AHEAD]:
            measurement.expect(coming)
        found += measurement.towers_near(rough[i])
    towers = distinct_towers([tower.moved(offset) for tower in found], points)
    return sorted(towers, key=lambda tower: (-tower.probability, tower.x, tower.y))


@dataclass(frozen=True)
class _Measurement:
    """Measures towers in points.

    Attributes:
        surroundings: gives the occupied voxels around a position.
        points: gives the points around a position.
        conductors: those of the points that lie on conductors.
        offset: (3,) m, that rough and measured towers are relative to.
        voxel_size: m.
        tau: threshold of the model.
        settings: of the detection.
        bent: whether what conductors pass without a bend is no tower.
    """

    surroundings: Surroundings
    points: Surroundings
    conductors: ConductorPoints
    offset: np.ndarray
    voxel_size: float
    tau: float
    settings: DetectionSettings
    bent: bool

    def expect(self, rough: RoughTower) -> None:
        """Begin to look for the conductors at a rough tower."""
        place = np.array([rough.x, rough.y]) + self.offset[:2]
        self.conductors.expect(place, self._widest(rough))

    def towers_near(self, rough: RoughTower) -> list[MeasuredTower]:
        """The towers that the points show near a rough one.

        There may be two: one at the rough axis, and one amid the conductors, where the axis of a
        window tower is.
        """
        settings, offset = self.settings, self.offset
        axis = np.array([rough.x, rough.y])
        tests = BodyTests(settings.min_height, settings.min_upright, MIN_FREE)
        needed = settings.min_conductor * (1 if rough.probability >= self.tau else 2)
        found: list[MeasuredTower] = []

        # The first question is asked again where the axis is looked for amid the conductors.
        known: dict[tuple[float, ...], list[Span]] = {}

        def leaving(axis: np.ndarray, base: float, height: float, crossarm: float) -> list[Span]:
            question = *axis.tolist(), base, height, crossarm
            if question not in known:
                place, foot = axis + offset[:2], base + offset[2]
                spans = self.conductors.leaving(place, foot, height, crossarm, self.surroundings)
                known[question] = [replace(span, places=span.places - offset) for span in spans]
            return known[question]

        # The cheapest test first: most trees have no conductor anywhere near.
        widest = self._widest(rough)
        seen = leaving(axis, rough.base, rough.height, widest) if needed else []
        if sum(span.followed for span in seen) < needed / 2:
            return []
        near = self.points(axis + offset[:2], SURROUNDINGS_M) - offset
        for amid in (False,) if rough.pole else (False, True):
            share = settings.crossarm * (WIDE if amid else 1)
            crossarm = min(max(settings.eps / 2, share * rough.height), WIDEST_HEAD_M)
            shape = measure_structure(
                near, leaving, axis, rough.base, rough.height, crossarm, tests, amid
            )
            if shape is None or not shape.carries(needed):
                continue
            if rough.pole and shape.profile.width > POLE_M:
                continue
            spans = self._leading_on(shape)
            if not replace(shape, spans=spans).carries(needed):
                continue
            # In a dip conductors may pass a tower in a straight line.
            carried = shape.head.is_even(shape.profile.width / 2)
            tested = self.bent and shape.profile.width > POLE_M and not carried
            if tested and pass_without_bend(spans, np.array([shape.x, shape.y])):
                continue
            tower = MeasuredTower.of(rough, shape, spans)
            if not any(same_axis(tower, other) for other in found):
                found.append(tower)
        return found

    def _widest(self, rough: RoughTower) -> float:
        """m, largest distance at which a conductor passes the axis of a rough tower."""
        return min(self.settings.crossarm * WIDE * rough.height, WIDEST_HEAD_M)

    def _leading_on(self, shape: Structure) -> tuple[Span, ...]:
        """The spans of a structure that lead to a support or to the edge of the data."""
        place, base = np.array([shape.x, shape.y]), shape.ground.elevation
        far = self.surroundings(place + self.offset[:2], FURTHEST_M + FAR) - self.offset
        return tuple(s for s in shape.spans if leads_on(s, place, base, far, self.voxel_size))
