"""The clearances that are found in synthetic surveys, and the trees that could fall, against the
true ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from scenenet.clearance.danger import places
from scenenet.clearance.distance import nearest_on
from scenenet.clearance.records import SurveyClearances
from scenenet.clearance.settings import VEGETATION, WIRE, ClearanceSettings
from scenenet.clearance.touching import OWN, on_wires
from scenenet.experiments.line_truth.conductors import percentiles, true_one
from scenenet.line.records import SurveyLine
from scenenet.pointcloud.cloud import PointCloud
from scenenet.synthetic.codes import LOW, SCRUB, TALL, TREE
from scenenet.synthetic.corridor import Corridor
from scenenet.synthetic.truth import TrueConductor

SAME_PLACE_M = 3.0
"""m, planar distance up to which a danger place that was found is a true one: points with a gap of
less than that are one place."""

SAME_POINT_M = 0.05
"""m, distance up to which a point is one of true vegetation: coordinates are rounded to less."""


STANDING, ABOVE_GROUND_M = (SCRUB, TREE, LOW, TALL), 0.5
"""Class codes of what stands on the ground, and m above it from which a point is not ground."""


@dataclass(frozen=True)
class Comparison:
    """Found and true clearances of a line.

    Attributes:
        kind: of its towers.
        vegetation: (n,) m, errors of the distance of the nearest vegetation, of each conductor
            that was found and has true vegetation within reach.
        unseen: such conductors for which no vegetation was found.
        danger_points: points of true vegetation closer than the limit to a true conductor.
        places: true danger places of enough points; of these, ``missed`` were not found.
        false: danger places of vegetation, with enough points, whose nearest point is none.
        trees: true trees that could fall on a conductor; of these, ``trees_missed`` were not found.
        trees_false: trees that were found and could not fall on one, or are none.
    """

    kind: str
    vegetation: np.ndarray
    unseen: int
    danger_points: int
    places: int
    missed: int
    false: int
    trees: int
    trees_missed: int
    trees_false: int


def compare(
    kind: str,
    corridor: Corridor,
    cloud: PointCloud,
    line: SurveyLine,
    found: SurveyClearances,
    settings: ClearanceSettings,
) -> Comparison:
    """Compare what was found around the conductors of a corridor with what stands there.

    Args:
        cloud: the survey with its true classes.
        settings: with a voltage.
    """
    limits = settings.applied()
    assert limits is not None, "danger places need a voltage"
    plants = _standing(corridor, cloud, line)
    plan, space = cKDTree(plants[:, :2]), cKDTree(plants)
    hanging = [c for c in corridor.conductors if c.from_tower and c.to_tower]
    apart, errors, unseen = _vegetation(hanging, plants, plan, line, found, settings.reach)
    danger = plants[apart < limits.vegetation]
    joined = places(danger, np.zeros(len(danger), int))
    true_places = [rows for rows in joined if len(rows) >= settings.few_points]
    listed = [place for place in found.dangers if place.kind == VEGETATION]
    at = np.array([(place.x, place.y, place.z) for place in listed]).reshape(-1, 3)
    shown = _shown(found, limits.vegetation)
    many = np.array([place.points >= settings.few_points for place in listed], bool)
    missed = sum(
        not len(shown) or cKDTree(shown).query(danger[rows, :2])[0].min() > SAME_PLACE_M
        for rows in true_places
    )
    trees, trees_missed, trees_false = _trees(corridor, hanging, found, settings)
    return Comparison(
        kind=kind, vegetation=errors, unseen=unseen, danger_points=len(danger),
        places=len(true_places), missed=missed,
        false=int(np.sum(space.query(at)[0][many] > SAME_POINT_M)) if len(at) else 0,
        trees=trees, trees_missed=trees_missed, trees_false=trees_false,
    )  # fmt: skip


def _vegetation(
    hanging: list[TrueConductor],
    plants: np.ndarray,
    plan: cKDTree,
    line: SurveyLine,
    found: SurveyClearances,
    reach: float,
) -> tuple[np.ndarray, np.ndarray, int]:
    """Distances of plants (P, 3) and true conductors.

    Args:
        plan: the plants in plan.
        reach: m, of the clearances.

    Returns:
        (P,) m, distance of each plant from the nearest conductor, inf where none is near;
        (n,) m, error of the smallest distance of each conductor, where that was found; the number
        of conductors for which it was not found.
    """
    nearest = {
        (place.span_id, place.conductor_id): place.distance
        for place in found.places
        if place.what == "nearest" and place.kind == VEGETATION
    }
    errors, unseen = [], 0
    apart = np.full(len(plants), np.inf)
    held = [c for c in line.conductors if c.kind != "cable"]
    for true in hanging:
        rows = _beside(true, plan, reach)
        if not len(rows):
            continue
        distance = nearest_on(true.catenary, plants[rows]).distance
        apart[rows] = np.minimum(apart[rows], distance)
        own = true_one(true, held)
        if own is None or distance.min() > reach:
            continue
        seen = nearest.get((own.span_id, own.conductor_id))
        if seen is None:
            unseen += 1
        else:
            errors.append(abs(seen - float(distance.min())))
    return apart, np.array(errors), unseen


def _shown(found: SurveyClearances, limit: float) -> np.ndarray:
    """(n, 2) m, where the results show a danger place of what stands.

    Places that are joined by what is found between them are listed as one, at their worst point.
    The profile of the span shows the others. What is thin and straight in the air, as a cable is,
    is listed as a wire, which has a limit of its own and is not a danger from the same distance.
    """
    plants = [place for place in found.dangers if place.kind == VEGETATION]
    listed = plants + [place for place in found.places if place.kind == WIRE]
    spans = {place.span_id for place in plants}
    steps = (
        (step.x, step.y)
        for step in found.profile
        if step.kind == VEGETATION and step.distance < limit and step.span_id in spans
    )
    return np.array([*((place.x, place.y) for place in listed), *steps]).reshape(-1, 2)


def _standing(corridor: Corridor, cloud: PointCloud, line: SurveyLine) -> np.ndarray:
    """(n, 3) m, the points of what stands on the ground: vegetation, and the few masts, cranes and
    houses of the scene, which count as vegetation where no class says what they are.

    Cables of other lines have the class of tall things too. Those that were found are none.
    """
    settings = corridor.settings
    xyz, codes = cloud.xyz, cloud.classification
    standing = np.isin(codes, STANDING)
    x, y = xyz[:, 0] - settings.easting, xyz[:, 1] - settings.northing
    standing &= xyz[:, 2] - corridor.terrain.height(x, y) > ABOVE_GROUND_M
    tall = np.flatnonzero(standing & (codes == TALL))
    cables = [wire for wire in line.conductors if wire.kind == "cable"]
    standing[tall[on_wires(xyz[tall], cables) == OWN]] = False
    return xyz[standing]


def _beside(true: TrueConductor, plan: cKDTree, reach: float) -> np.ndarray:
    """Rows of the points that are within reach, about, of a conductor in plan."""
    curve = true.catenary
    steps = np.linspace(0, 1, 2 + int(curve.length / reach))
    near = plan.query_ball_point(curve.at_shares(steps)[:, :2], 1.2 * reach)
    return np.unique(np.concatenate([np.array(rows, int) for rows in near]))


def _trees(
    corridor: Corridor,
    hanging: Sequence[TrueConductor],
    found: SurveyClearances,
    settings: ClearanceSettings,
) -> tuple[int, int, int]:
    """True trees that could fall on a conductor, those of them that were not found, and those found
    that could not, or are none."""
    trees = [tree for tree in corridor.trees if tree.height >= settings.tree_height]
    feet = np.array([(tree.x, tree.y, tree.base) for tree in trees]).reshape(-1, 3)
    height, radius = (np.array([getattr(t, name) for t in trees]) for name in ("height", "radius"))
    apart = np.full(len(trees), np.inf)
    for true in hanging:
        apart = np.minimum(apart, nearest_on(true.catenary, feet).distance)
    falling = np.flatnonzero(apart < height)
    listed = np.array([(tree.x, tree.y) for tree in found.trees]).reshape(-1, 2)
    # The top of a crown may be anywhere in it.
    missed = sum(
        not len(listed) or np.hypot(*(listed - feet[row, :2]).T).min() > radius[row]
        for row in falling
    )
    if not len(falling):
        return 0, 0, len(listed)
    stems = cKDTree(feet[falling, :2])
    widest = float(radius[falling].max())
    false = 0
    for place in listed:
        near = falling[stems.query_ball_point(place, widest)]
        false += not (np.hypot(*(feet[near, :2] - place).T) <= radius[near]).any()
    return len(falling), missed, false


def table(comparisons: Sequence[Comparison]) -> list[str]:
    """Lines of a Markdown table."""
    lines = [
        "| towers of kind | error of the nearest vegetation, m: median, 95 %, largest | conductors "
        "compared, without any found | points too near | danger places found | false | trees that "
        "could fall found | false |",
        "|---" * 8 + "|",
    ]
    for one in comparisons:
        error = percentiles(one.vegetation, 50, 95, 100)
        lines.append(
            f"| {one.kind} | {error[0]:.3f}, {error[1]:.2f}, {error[2]:.2f} | "
            f"{len(one.vegetation)}, {one.unseen} | {one.danger_points} | "
            f"{one.places - one.missed} of {one.places} | {one.false} | "
            f"{one.trees - one.trees_missed} of {one.trees} | {one.trees_false} |"
        )
    return lines
