"""Towers of a survey: candidates from voxels, measured and decided in points."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scenenet.core.progress import track
from scenenet.detection.candidates import SURROUNDINGS_M, DetectedVoxels
from scenenet.detection.conductor_rules import FAR, FURTHEST_M, HEAD, WIDE, WIDEST_HEAD_M
from scenenet.detection.conductors import ConductorPoints, Span
from scenenet.detection.following import leads_on
from scenenet.detection.measure_structure import measure_structure
from scenenet.detection.rough import RoughTower, rough_towers
from scenenet.detection.settings import DetectionSettings
from scenenet.detection.structure import BodyTests, Structure
from scenenet.detection.surroundings import Surroundings

MIN_FREE = 1 / 3
"""Smallest share of the levels at which the body stands free, by points."""

APART_M = 2.0
"""m, smallest distance between two towers, measured in points."""

AHEAD = 6
"""Number of rough towers ahead of the one that is measured at which conductors are looked for."""


@dataclass(frozen=True)
class MeasuredTower:
    """A tower, measured in points.

    Attributes:
        x, y: m, centre of its body.
        base: m, elevation of the ground at its axis.
        height: m, from the base to its top.
        width: m, of its body where it stands free.
        free: share of the levels at which its body stands free.
        upright: share of the levels from foot to top with a point of its body.
        spans: directions in which conductors leave, the longest first.
        probability: highest probability of its voxels.
        voxels: rows of its detected voxels in the arguments of ``find_towers``.
        structure: its shape, which says which points are its own.
    """

    x: float
    y: float
    base: float
    height: float
    width: float
    free: float
    upright: float
    spans: tuple[Span, ...]
    probability: float
    voxels: np.ndarray
    structure: Structure

    @classmethod
    def of(cls, rough: RoughTower, structure: Structure, spans: tuple[Span, ...]) -> MeasuredTower:
        """A tower that was found at a rough one, with the conductors that lead on."""
        return cls(
            x=structure.x,
            y=structure.y,
            base=structure.ground.elevation,
            height=structure.height,
            width=structure.profile.width,
            free=structure.profile.free,
            upright=structure.upright,
            spans=spans,
            probability=rough.probability,
            voxels=rough.voxels,
            structure=structure,
        )

    def moved(self, offset: np.ndarray) -> MeasuredTower:
        """The same tower elsewhere; ``offset`` is (3,) m."""
        x, y, z = offset.tolist()
        structure = self.structure.moved(x, y, z)
        return replace(self, x=self.x + x, y=self.y + y, base=self.base + z, structure=structure)


def find_towers(
    centres: np.ndarray,
    probability: np.ndarray,
    surroundings: Surroundings,
    points: Surroundings,
    voxel_size: float,
    tau: float,
    settings: DetectionSettings,
    progress: str | None = None,
) -> list[MeasuredTower]:
    """Find the towers among detected voxels and measure each in points, highest probability first.

    Voxels give approximate axes (``scenenet.detection.rough``). The points around an axis then
    decide, so that the result hardly depends on where the borders of the voxels lie.

    Args:
        centres: (V, 3) m, of the voxels with probability >= ``settings.threshold(tau)``.
        probability: (V,).
        surroundings: gives the occupied voxels around a position.
        points: gives the points around a position.
        voxel_size: m.
        tau: threshold of the model.
        progress: label of the progress on stderr; None shows no progress.
    """
    if len(centres) == 0:
        return []
    offset = centres.min(axis=0)
    detected = DetectedVoxels(centres - offset, probability, voxel_size)
    rough = rough_towers(detected, offset, surroundings, settings)
    conductors = ConductorPoints(points, HEAD * settings.min_height)
    measurement = _Measurement(surroundings, points, conductors, offset, voxel_size, tau, settings)
    found: list[MeasuredTower] = []
    places = range(len(rough)) if progress is None else track(range(len(rough)), progress)
    for i in places:
        for coming in rough[i : i + AHEAD]:
            measurement.expect(coming)
        found += measurement.towers_near(rough[i])
    towers = [tower.moved(offset) for tower in _distinct(found)]
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
    """

    surroundings: Surroundings
    points: Surroundings
    conductors: ConductorPoints
    offset: np.ndarray
    voxel_size: float
    tau: float
    settings: DetectionSettings

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

        def leaving(axis: np.ndarray, base: float, height: float, crossarm: float) -> list[Span]:
            place, foot = axis + offset[:2], base + offset[2]
            spans = self.conductors.leaving(place, foot, height, crossarm, self.surroundings)
            return [replace(span, places=span.places - offset) for span in spans]

        # The cheapest test first: most trees have no conductor anywhere near.
        widest = self._widest(rough)
        seen = leaving(axis, rough.base, rough.height, widest) if needed else []
        if sum(span.followed for span in seen) < needed / 2:
            return []
        near = self.points(axis + offset[:2], SURROUNDINGS_M) - offset
        for amid in (False, True):
            share = settings.crossarm * (WIDE if amid else 1)
            crossarm = min(max(settings.eps / 2, share * rough.height), WIDEST_HEAD_M)
            shape = measure_structure(
                near, leaving, axis, rough.base, rough.height, crossarm, tests, amid
            )
            if shape is None or not shape.carries(needed):
                continue
            spans = self._leading_on(shape)
            if not replace(shape, spans=spans).carries(needed):
                continue
            if all(np.hypot(shape.x - other.x, shape.y - other.y) > APART_M for other in found):
                found.append(MeasuredTower.of(rough, shape, spans))
        return found

    def _widest(self, rough: RoughTower) -> float:
        """m, largest distance at which a conductor passes the axis of a rough tower."""
        return min(self.settings.crossarm * WIDE * rough.height, WIDEST_HEAD_M)

    def _leading_on(self, shape: Structure) -> tuple[Span, ...]:
        """The spans of a structure that lead to a support or to the edge of the data."""
        place, base = np.array([shape.x, shape.y]), shape.ground.elevation
        far = self.surroundings(place + self.offset[:2], FURTHEST_M + FAR) - self.offset
        return tuple(s for s in shape.spans if leads_on(s, place, base, far, self.voxel_size))


def _distinct(found: list[MeasuredTower]) -> list[MeasuredTower]:
    """One tower for each structure: several axes may have led to it."""
    towers: list[MeasuredTower] = []
    for tower in sorted(found, key=lambda t: (-t.free * t.upright * t.height, t.x, t.y)):
        wide = tower.width / 2
        if all(
            np.hypot(tower.x - t.x, tower.y - t.y) > max(APART_M, wide + t.width / 2)
            for t in towers
        ):
            towers.append(tower)
    return towers
