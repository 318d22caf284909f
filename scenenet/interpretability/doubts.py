"""Which towers of a survey a person should check, and why."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from scenenet.detection.conductor_rules import FAR, WIDE, WIDEST_HEAD_M
from scenenet.detection.settings import DetectionSettings
from scenenet.detection.survey_tower import SurveyTower
from scenenet.line.notes import NOTE_KINDS, LineNote
from scenenet.pointcloud.units import METRE, SYMBOLS

WIDEST_ARM = WIDE * float(DetectionSettings.model_fields["crossarm"].default)
"""Widest reach of crossarms from the axis, as a share of the height."""

FEW_POINTS_PER_M = 5.0
"""Own points per m of height below which the shape of a tower is hard to see. At 10 points per m2
poles and pylons have 14 and more, at 2 points per m2 a pole has 1 to 5."""

ENOUGH = 5
"""Number of towers from which a height can be unusual among them."""

UNUSUAL = 3.0
"""Median absolute deviations, scaled to standard deviations, beyond which a height is unusual."""

SCALE = 1.4826
"""Standard deviation of normal values with a median absolute deviation of 1."""

AS_USUAL = 0.3
"""Share of the median by which any height may differ: spans over valleys and roads need it."""

BESIDE_M = 10.0
"""m between two towers below which they may be one."""


class Units(NamedTuple):
    """Sizes in m of the units in plan and of heights, and their names."""

    planar_m: float
    vertical_m: float
    planar_name: str
    vertical_name: str

    @property
    def planar(self) -> str:
        """What follows a length in plan."""
        return SYMBOLS.get(self.planar_name, self.planar_name)

    @property
    def vertical(self) -> str:
        """What follows a height."""
        return SYMBOLS.get(self.vertical_name, self.vertical_name)


def doubts(
    tower: SurveyTower,
    tau: float | None,
    unit_sizes: tuple[float, float, float] = (1.0, 1.0, 1.0),
    unit_names: tuple[str, str, str] = (METRE, METRE, METRE),
) -> tuple[str, ...]:
    """Why a person should check a tower. A tower without any of these reasons is not doubtful.

    Args:
        tower: in the units of the survey.
        tau: of the model; None if it is not known.
        unit_sizes, unit_names: sizes in m of the units of x, y and z, and their names.
    """
    units = Units(*unit_sizes[1:], *unit_names[1:])
    reasons = []
    to_edge = tower.edge_distance * units.planar_m
    height = tower.height * units.vertical_m
    if to_edge < min(WIDEST_ARM * height, WIDEST_HEAD_M):
        reasons.append(
            f"it is {tower.edge_distance:.0f} {units.planar} from the edge of the data, nearer "
            "than crossarms may reach: part of it may be missing"
        )
    if tower.conductor_directions == 0:
        reasons.append("no conductors were found that leave it: a lone pole or tree looks alike")
    if tower.conductor_directions == 1 and to_edge >= FAR:
        reasons.append("conductors leave it in one direction only: the end of a line, or no tower")
    if tower.points < FEW_POINTS_PER_M * height:
        reasons.append(
            f"it has {tower.points} points of its own, fewer than {FEW_POINTS_PER_M:.0f} per m of "
            "its height: its shape is hard to see"
        )
    if tau is not None and tower.probability < tau:
        reasons.append(
            f"its probability is below tau, {tau:.3f}: its conductors and its body support it"
        )
    elif tau is not None and tower.probability < (1 + tau) / 2:
        reasons.append(f"its probability is not far above tau, {tau:.3f}")
    return tuple(reasons)


def survey_doubts(
    towers: Sequence[SurveyTower],
    tau: float | None,
    unit_sizes: tuple[float, float, float] = (1.0, 1.0, 1.0),
    unit_names: tuple[str, str, str] = (METRE, METRE, METRE),
    notes: Iterable[LineNote] = (),
) -> list[tuple[str, ...]]:
    """Of each tower of a survey, why a person should check it: ``doubts``, and what the other
    towers and the line say about it.

    Args:
        towers, tau, unit_sizes, unit_names: as ``doubts``.
        notes: of the line; none where no line was looked for.
    """
    units = Units(*unit_sizes[1:], *unit_names[1:])
    heights, neighbours = _unusual_heights(towers, units), _neighbours(towers, units.planar_m)
    of_line = _of_line(notes)
    return [
        (
            *doubts(tower, tau, unit_sizes, unit_names),
            *height,
            *neighbour,
            *of_line.get(tower.id, ()),
        )
        for tower, height, neighbour in zip(towers, heights, neighbours, strict=True)
    ]


def _of_line(notes: Iterable[LineNote]) -> dict[int, list[str]]:
    """Id of a tower -> what the line says about it, each reason once."""
    found: dict[int, list[str]] = {}
    for note in notes:
        reason = NOTE_KINDS[note.what].of_tower
        for tower in note.towers if reason else ():
            own = found.setdefault(tower, [])
            if reason not in own:
                own.append(reason)
    return found


def doubt_rank(reasons: Sequence[str], probability: float) -> tuple[int, float]:
    """By which towers are sorted, those to check first: the more reasons, and among these the lower
    the probability, the earlier."""
    return -len(reasons), probability


def _unusual_heights(towers: Sequence[SurveyTower], units: Units) -> list[list[str]]:
    """A reason for each tower that is much lower or taller than most of the survey."""
    heights = np.array([tower.height for tower in towers])
    if len(heights) < ENOUGH:
        return [[] for _ in towers]
    middle = float(np.median(heights))
    usual = max(UNUSUAL * SCALE * float(np.median(np.abs(heights - middle))), AS_USUAL * middle)
    return [
        [
            f"it is {height:.0f} {units.vertical} tall, and half of the towers of the survey are "
            f"{'taller' if height < middle else 'lower'} than {middle:.0f} {units.vertical}"
        ]
        if abs(height - middle) > usual
        else []
        for height in heights
    ]


def _neighbours(towers: Sequence[SurveyTower], planar_m: float) -> list[list[str]]:
    """A reason for each tower that stands close to another one."""
    from scipy.spatial import cKDTree

    if len(towers) < 2:
        return [[] for _ in towers]
    places = np.array([(tower.x, tower.y) for tower in towers]) * planar_m
    apart, nearest = cKDTree(places).query(places, k=2)
    return [
        [f"it stands {distance:.1f} m beside tower {towers[other].id}: they may be one"]
        if distance < BESIDE_M
        else []
        for distance, other in zip(apart[:, 1], nearest[:, 1], strict=True)
    ]
