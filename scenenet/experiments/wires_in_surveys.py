"""Points of wires that models find in whole synthetic surveys, line by line.

    python -m scenenet.experiments.wires_in_surveys [--model WIRES...] [--seed 14000] [--line] ...

makes the surveys of eight lines that differ in their towers, in the wires of a conductor, in the
pulses per m2, in relief and in trees. Each has a seed of its own, counted from the first one: with
another first seed it makes other lines of the same kinds. Prints a Markdown table of the points
taken for wires against the truth.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scenenet.experiments.synthetic_wires import every_point, look, two_digits
from scenenet.experiments.wire_options import add_line, print_table, wire_parser
from scenenet.metrics.voxel_scores import Confusion
from scenenet.synthetic.settings import SyntheticSettings

FIRST_SEED = 14000
OTHER_LINES: float = SyntheticSettings.model_fields["other_lines"].default

PYLONS: Mapping[str, Any] = {
    "height": (24, 50), "span": 280, "span_spread": 30, "half_width": 30, "circuits": 2,
    "earth_wires": 1, "catenary": 1600, "margin": 28.0, "relief": 80, "section": 0, "tension": 0.2,
}  # fmt: skip
"""Settings that the lines of pylons share."""

LINES: Mapping[str, Mapping[str, Any]] = {
    "poles": {"towers": 8, "relief": 100},
    "wooden": {"towers": 8, "kinds": {"wooden": 1}, "height": (12, 16), "span": 60,
               "span_spread": 6, "density": 12},
    "h-frames": {"towers": 8, "kinds": {"h_frame": 1}, "relief": 120, "tree_cover": 0.35},
    "lattice-1": {**PYLONS, "towers": 5, "kinds": {"lattice": 1}, "bundle": 1, "density": 12},
    "lattice-2": {**PYLONS, "towers": 5, "kinds": {"lattice": 1}, "bundle": 2, "density": 25},
    "lattice-4": {**PYLONS, "towers": 4, "kinds": {"lattice": 1}, "bundle": 4, "density": 40},
    "window-2": {**PYLONS, "towers": 5, "kinds": {"window": 1}, "bundle": 2, "density": 60},
    "window-1": {**PYLONS, "towers": 5, "kinds": {"window": 1}, "bundle": 1, "density": 20},
}  # fmt: skip
"""Name -> settings of a line; that of pylons ends with the wires of a conductor."""


@dataclass(frozen=True)
class Scored:
    """What is found of one line.

    Attributes:
        name: of the line.
        settings: of its survey.
        found: points that each model takes for wires against the truth.
    """

    name: str
    settings: SyntheticSettings
    found: tuple[Confusion, ...]


def lines_of(first_seed: int, other_lines: float = OTHER_LINES) -> dict[str, SyntheticSettings]:
    """Name -> settings of each line; the seeds are counted from the first.

    Args:
        other_lines: cables of other lines per km, which are not wires of this one in the truth.
    """
    return {
        name: SyntheticSettings(**own, seed=first_seed + number, other_lines=other_lines)
        for number, (name, own) in enumerate(LINES.items())
    }


def score(
    name: str,
    settings: SyntheticSettings,
    models: Sequence[Path],
    folder: Path,
    *,
    line: bool = False,
) -> Scored:
    """Make the survey of a line, and compare what each model finds with the truth; with the line,
    without it and with it.

    Raises:
        InputError: a model cannot be used.
    """
    wires = look(settings, models, folder, line=line)
    return Scored(name, settings, tuple(Confusion.of(each, wires.true) for each in wires.taken))


def table(rows: Sequence[Scored], models: Sequence[str]) -> list[str]:
    """A Markdown table: what the lines are, precision, recall and IoU of each model, and the IoU of
    the answer that every point is a wire. The last row has the means of the IoUs.

    Args:
        models: their names, in the order of ``Scored.found``.
    """
    alone = len(models) == 1
    heads = ["" if alone else f"{model}: " for model in models]
    head = ["line", "wires of a conductor", "pulses per m2", "relief, m", "trees, % of the ground"]
    for each in heads:
        head += [f"{each}precision, recall", f"{each}IoU"]
    head.append("every point: IoU")
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    ious = []
    for row in rows:
        own = row.settings
        cells = [row.name, f"{own.bundle}", f"{own.density:g}", f"{own.relief:g}"]
        cells.append(f"{100 * own.tree_cover:g}")
        for counts in row.found:
            cells.append(f"{two_digits(counts.precision)}, {two_digits(counts.recall)}")
            cells.append(two_digits(counts.iou_tower))
        trivial = every_point(row.found[0])
        lines.append(f"| {' | '.join([*cells, two_digits(trivial.iou_tower)])} |")
        ious.append([counts.iou_tower or 0.0 for counts in (*row.found, trivial)])
    means = [f"{value:.2f}" for value in np.mean(ious, axis=0)]
    cells = [cell for mean in means[:-1] for cell in ("", mean)]
    return [*lines, f"| mean | | | | | {' | '.join([*cells, means[-1]])} |"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; its exit status."""
    parser = wire_parser("wires_in_surveys", __doc__, several=True)
    parser.add_argument(
        "--seed",
        type=int,
        default=FIRST_SEED,
        help=f"of the first line; the others follow (default {FIRST_SEED})",
    )
    parser.add_argument(
        "--lines",
        nargs="+",
        choices=list(LINES),
        default=list(LINES),
        metavar="LINE",
        help=f"some of {', '.join(LINES)} (default all)",
    )
    parser.add_argument(
        "--other-lines",
        type=float,
        default=OTHER_LINES,
        metavar="PER_KM",
        help="cables of other lines, which hang in the air as wires do and count as false: the "
        f"truth has the wires of the line itself (default {OTHER_LINES:g} per km)",
    )
    add_line(parser)
    chosen = parser.parse_args(arguments)
    made = lines_of(chosen.seed, chosen.other_lines)
    wanted = {name: of for name, of in made.items() if name in chosen.lines}

    def make(folder: Path) -> list[str]:
        rows = [score(*each, chosen.model, folder, line=chosen.line) for each in wanted.items()]
        names = [model.stem for model in chosen.model]
        if chosen.line:
            names = [each for name in names for each in (name, f"{name} and line")]
        return table(rows, names)

    return print_table(make)


if __name__ == "__main__":
    sys.exit(main())
