"""The conductors and spans that are found in synthetic surveys, against the true ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from scenenet.detection.survey_tower import SurveyTower
from scenenet.line.records import Conductor, SurveyLine
from scenenet.synthetic.corridor import Corridor
from scenenet.synthetic.truth import TrueConductor

SAME_M = 0.3
"""m, median distance up to which a conductor is the true one."""

PLACES, HALF = 60, 0.5
"""Places of a true conductor that are compared, and smallest share of it along which the one found
runs. That of the next span touches it at the tower."""

AT_TOWER_M = 5.0
"""m, distance up to which a tower is the true one (docs/reference/glossary.md)."""


@dataclass(frozen=True)
class Comparison:
    """Found and true conductors of a line.

    Attributes:
        kind: of its towers.
        towers: (true ones found, found, true).
        found: true conductors between two towers that were found; of how many: ``true``.
        false: conductors found that hang nowhere.
        sag: (n,) m, errors of the sag of those found, between the true attachments.
        c: (n,) relative errors of the catenary parameter.
        attachment: (2 n,) m, distances of the found attachments from the true ones.
        rmse: (n,) m.
        ordered: spans between neighbouring towers, in the order of the line.
        spans: true spans between two towers.
    """

    kind: str
    towers: tuple[int, int, int]
    found: int
    true: int
    false: int
    sag: np.ndarray
    c: np.ndarray
    attachment: np.ndarray
    rmse: np.ndarray
    ordered: int
    spans: int


def compare(
    kind: str, corridor: Corridor, towers: Sequence[SurveyTower], line: SurveyLine
) -> Comparison:
    """Compare what was found in a corridor with what stands there.

    Conductors that leave the survey count as false if they hang nowhere, and are not asked for.
    Cables of no line count as neither.
    """
    true = corridor.conductors
    inner = [c for c in true if c.from_tower and c.to_tower]
    held = [c for c in line.conductors if c.kind != "cable"]
    pairs = [(t, true_one(t, held)) for t in inner]
    own = [(t, c) for t, c in pairs if c is not None]
    sag, parameter, attachment = [], [], []
    for t, c in own:
        ends = np.array([t.catenary.start, t.catenary.end])
        along, _ = c.catenary.along(ends)
        sag.append(abs(c.catenary.between(*np.sort(along).tolist()).sag - t.catenary.sag))
        parameter.append(abs(c.catenary.parameter / t.catenary.parameter - 1))
        mine = np.array([c.catenary.start, c.catenary.end])
        apart = np.linalg.norm(ends[:, None] - mine[None], axis=2)
        attachment += apart.min(axis=1).tolist()
    hanging = {id(c) for c in held for t in true if _median_distance(t, c) <= SAME_M}
    names = _true_towers(corridor, towers)
    order = [
        (names.get(span.from_tower, 0), names.get(span.to_tower, 0))
        for span in line.spans
        if span.line and span.from_tower and span.to_tower
    ]
    numbers = [first + last for first, last in order if abs(first - last) == 1 and first and last]
    steps = [abs(after - before) == 2 for before, after in pairwise(numbers)]
    return Comparison(
        kind=kind,
        towers=(len(set(names.values())), len(towers), len(corridor.towers)),
        found=len({id(c) for _, c in own}),
        true=len(inner),
        false=sum(id(c) not in hanging for c in held),
        sag=np.array(sag),
        c=np.array(parameter),
        attachment=np.array(attachment),
        rmse=np.array([c.rmse for _, c in own]),
        ordered=sum(steps) + bool(numbers),
        spans=len(corridor.towers) - 1,
    )


def true_one(true: TrueConductor, found: Sequence[Conductor]) -> Conductor | None:
    """The conductor that is the true one, along half of it at least; None if there is none."""
    apart = [(_median_distance(true, c, HALF), n) for n, c in enumerate(found)]
    distance, number = min(apart, default=(np.inf, -1))
    return found[number] if distance <= SAME_M else None


def _median_distance(true: TrueConductor, found: Conductor, least: float = 2 / PLACES) -> float:
    """m, of the part of the true conductor along which the found one runs; infinite for less than
    this share of it."""
    places = true.catenary.at_shares(np.linspace(0, 1, PLACES))
    along, _ = found.catenary.along(places)
    beside = (along >= -1.0) & (along <= found.catenary.length + 1.0)
    if beside.mean() < least:
        return np.inf
    return float(np.median(np.hypot(*found.catenary.residuals(places[beside]))))


def _true_towers(corridor: Corridor, towers: Sequence[SurveyTower]) -> dict[int, int]:
    """Id of each tower that was found -> number of the true one."""
    places = np.array([(t.x, t.y) for t in corridor.towers])
    names = {}
    for tower in towers:
        apart = np.hypot(*(places - (tower.x, tower.y)).T)
        if apart.min() <= AT_TOWER_M:
            names[tower.id] = corridor.towers[int(np.argmin(apart))].id
    return names


def percentiles(values: np.ndarray, *shares: float) -> np.ndarray:
    """Percentiles of values (n,), nan without any.

    Args:
        shares: %.
    """
    return np.percentile(values if len(values) else [np.nan], shares)


def table(comparisons: Sequence[Comparison]) -> list[str]:
    """Lines of a Markdown table."""
    lines = [
        "| towers of kind | towers found, false | conductors found | false | error of sag, m: "
        "median, 95 %, largest | of c, %: median | of attachments, m: median, 95 % | RMSE, m: "
        "median | spans in order |",
        "|---" * 9 + "|",
    ]
    for one in comparisons:
        found, listed, true = one.towers
        sag, ends = percentiles(one.sag, 50, 95, 100), percentiles(one.attachment, 50, 95)
        (error,), (rmse,) = percentiles(100 * one.c, 50), percentiles(one.rmse, 50)
        lines.append(
            f"| {one.kind} | {found} of {true}, {listed - found} | {one.found} of {one.true} | "
            f"{one.false} | {sag[0]:.3f}, {sag[1]:.3f}, {sag[2]:.3f} | {error:.1f} "
            f"| {ends[0]:.2f}, {ends[1]:.2f} | {rmse:.3f} | "
            f"{one.ordered} of {one.spans} |"
        )
    return lines
