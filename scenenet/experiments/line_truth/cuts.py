"""Conductors that are found in cuts around single towers of synthetic lines, against the truth.

    python -m scenenet.experiments.line_truth.cuts [--model WIRES] [--radius 15] [--seed 5] ...

cuts the survey of a line of each kind of tower into files around each of its towers, such as
recordings of single towers are, and finds the conductors in each. Prints a Markdown table.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scenenet.core.progress import quiet, track
from scenenet.detection.settings import DetectionSettings
from scenenet.experiments.line_truth.conductors import SAME_M
from scenenet.experiments.line_truth.lines import add_line, line_of
from scenenet.experiments.wire_options import print_table, wire_parser
from scenenet.line.records import Conductor, SurveyLine
from scenenet.models.packaged import packaged_model
from scenenet.pointcloud.cloud import PointCloud
from scenenet.pointcloud.las.writing import write_las
from scenenet.pointcloud.reading import read
from scenenet.prediction.predict import predict_survey
from scenenet.prediction.settings import PredictSettings
from scenenet.synthetic.corridor import Corridor
from scenenet.synthetic.settings import SyntheticSettings
from scenenet.synthetic.survey import make_survey
from scenenet.synthetic.truth import TrueConductor, TrueTower

STEP_M = 0.5
"""m, distance of the places of a true conductor that are compared."""

ON_TOWERS = 1.5
"""Points per m2 of tower members for each pulse per m2 of ground."""

TRUE_SHARE, FALSE_SHARE = 0.5, 0.05
"""Share of the part of a true conductor in a cut along which one that was found runs; and least
share along which one that is not false runs, as where a conductor is found in two pieces."""


@dataclass(frozen=True)
class Comparison:
    """Found and true conductors of the cuts of a line.

    Attributes:
        kind: of its towers.
        cuts: number of them; of ``with_tower`` the tower was found.
        found: true conductors that were found; of how many: ``true``.
        false: conductors found that hang nowhere.
        cables: found wires of no line.
    """

    kind: str
    cuts: int
    with_tower: int
    found: int
    true: int
    false: int
    cables: int


def run(settings: SyntheticSettings, wires: Path, radius: float, folder: Path) -> Comparison:
    """Make a survey of towers of one kind, cut it, predict each cut, and compare.

    Args:
        wires: model of wires.
        radius: m, of the cuts around the axes of the towers.

    Raises:
        InputError: the model cannot be used.
    """
    (kind,) = settings.kinds
    survey, truth = folder / f"{kind}.laz", folder / f"{kind}.truth.laz"
    make_survey(settings, survey, truth, progress=f"{kind}: survey made")
    corridor, cloud = Corridor(settings), read(truth)
    cut, models = folder / f"{kind}.cut.laz", [packaged_model(), wires]
    total = np.zeros(5, int)
    for tower in track(corridor.towers, f"{kind}: cuts predicted"):
        write_las(cut, around(cloud, tower, radius))
        with quiet(), predict_survey(cut, models, PredictSettings(), DetectionSettings()) as found:
            assert found.line is not None
            counted = compare(corridor.conductors, tower, radius, found.line)
            total += [len(found.towers) > 0, *counted]
    return Comparison(kind, len(corridor.towers), *total.tolist())


def around(cloud: PointCloud, tower: TrueTower, radius: float) -> PointCloud:
    """The points up to ``radius`` in m from the axis of a tower in plan."""
    away = np.hypot(cloud.xyz[:, 0] - tower.x, cloud.xyz[:, 1] - tower.y)
    return cloud.select(np.flatnonzero(away <= radius))


def compare(
    conductors: Sequence[TrueConductor], tower: TrueTower, radius: float, line: SurveyLine
) -> tuple[int, int, int, int]:
    """Compare what was found in a cut with the true conductors of its tower.

    Args:
        radius: m, of the cut.

    Returns:
        true conductors found, all true ones, conductors that hang nowhere, cables of no line.
    """
    parts = [
        _within(conductor, tower, radius)
        for conductor in conductors
        if tower.id in (conductor.from_tower, conductor.to_tower)
    ]
    parts = [part for part in parts if len(part) > 1]
    held = [found for found in line.conductors if found.kind != "cable"]
    seen = sum(any(_runs_along(found, part, TRUE_SHARE) for found in held) for part in parts)
    hanging = sum(any(_runs_along(found, part, FALSE_SHARE) for part in parts) for found in held)
    return seen, len(parts), len(held) - hanging, len(line.conductors) - len(held)


def _within(conductor: TrueConductor, tower: TrueTower, radius: float) -> np.ndarray:
    """(n, 3) m, places of a conductor, ``STEP_M`` apart, up to ``radius`` from the axis."""
    curve = conductor.catenary
    places = curve.at_shares(np.linspace(0, 1, 2 + int(curve.length / STEP_M)))
    return places[np.hypot(places[:, 0] - tower.x, places[:, 1] - tower.y) <= radius]


def _runs_along(found: Conductor, places: np.ndarray, share: float) -> bool:
    """Whether a conductor runs along a share of these places (n, 3), and near them."""
    along, _ = found.catenary.along(places)
    beside = (along >= -1.0) & (along <= found.catenary.length + 1.0)
    if beside.mean() < share:
        return False
    apart = np.hypot(*found.catenary.residuals(places[beside]))
    return bool(np.median(apart) <= SAME_M)


def table(comparisons: Sequence[Comparison]) -> list[str]:
    """Lines of a Markdown table."""
    lines = [
        "| towers of kind | cuts with the tower found | conductors found | false | cables |",
        "|---" * 5 + "|",
    ]
    for one in comparisons:
        lines.append(
            f"| {one.kind} | {one.with_tower} of {one.cuts} | {one.found} of {one.true} | "
            f"{one.false} | {one.cables} |"
        )
    return lines


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; its exit status."""
    parser = wire_parser("line_truth.cuts", __doc__)
    add_line(parser, towers=5)
    parser.add_argument(
        "--radius", type=float, default=15.0, help="m, of the cuts around towers (default 15)"
    )
    parser.add_argument(
        "--density", type=float, help="pulses per m2 of ground (default: as surveys of lines have)"
    )
    chosen = parser.parse_args(arguments)
    dense = {}
    if chosen.density is not None:
        dense = {"density": chosen.density, "tower_density": ON_TOWERS * chosen.density}

    def make(folder: Path) -> list[str]:
        own = chosen.towers, chosen.seed, chosen.tension
        lines = [line_of(kind, *own, **dense) for kind in chosen.kinds]
        return table([run(line, chosen.model, chosen.radius, folder) for line in lines])

    return print_table(make)


if __name__ == "__main__":
    sys.exit(main())
