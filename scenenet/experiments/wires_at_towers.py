"""Points of conductors at synthetic towers that a model of wires finds, by distance from the axis.

    python -m scenenet.experiments.wires_at_towers [--model WIRES] [--seed 5] [--kinds ...] [--line]

makes the surroundings of a few towers of each kind, as towers that only carry and as tension
towers; those of pylons with bundles of one, two and four wires, and with few and with many points.
Prints a Markdown table.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np

from scenenet.experiments.synthetic_wires import every_point, look, two_digits
from scenenet.experiments.wire_options import add_kinds, add_line, print_table, wire_parser
from scenenet.metrics.voxel_scores import Confusion
from scenenet.synthetic.corridor import Corridor
from scenenet.synthetic.settings import SyntheticSettings

DISTANCES_M = (0.0, 3.0, 6.0, 9.0, 15.0)
"""m, distances from the axis of the nearest tower between which points are counted together."""
POLES: Mapping[str, Any] = {"density": 20.0, "margin": 14.0}
PYLONS: Mapping[str, Any] = {
    "height": (24, 50), "span": 310, "span_spread": 30, "half_width": 20, "circuits": 2,
    "earth_wires": 1, "catenary": 1600, "clearing": 6, "relief": 60, "flight_height": (90, 130),
    "high_strays": 0.02, "margin": 15.0,
}  # fmt: skip
"""Settings of the surroundings of poles and of pylons."""
BUNDLES = (1, 2, 4)
DENSITIES: tuple[tuple[float, float], ...] = ((12.0, 18.0), (60.0, 60.0))
"""Pulses per m2 of ground, and points per m2 of tower members, of pylons."""


@dataclass(frozen=True)
class Found:
    """What is found at the towers of one survey.

    Attributes:
        of: kind of tower, wires of a bundle, pulses per m2, and whether they are tension towers.
        near: points from each of ``DISTANCES_M`` to the next; the last one has no end.
    """

    of: tuple[str, int, float, bool]
    near: tuple[Confusion, ...]


def cases(kinds: Sequence[str], towers: int, seed: int) -> Iterator[SyntheticSettings]:
    """The settings of each survey. Each has a seed of its own, counted from ``seed``."""
    for kind in kinds:
        pylons = kind in ("lattice", "window")
        forms = [
            {**PYLONS, "bundle": bundle, "density": pulses, "tower_density": members}
            for bundle, (pulses, members) in product(BUNDLES, DENSITIES)
        ]
        for form, tension in product(forms if pylons else [dict(POLES)], (0.0, 1.0)):
            yield SyntheticSettings(
                **form, kinds={kind: 1.0}, section=1, towers=towers, seed=seed, tension=tension
            )
            seed += 1


def look_at_towers(
    settings: SyntheticSettings, wires: Path, folder: Path, *, line: bool = False
) -> Found:
    """Make a survey, and compare the points that the model finds, or the line, with the truth.

    Raises:
        InputError: the model cannot be used.
    """
    points = look(settings, [wires], folder, line=line)
    taken = points.taken[-1]
    axes = np.array([(tower.x, tower.y) for tower in Corridor(settings).towers])
    away = np.min([np.hypot(*(points.xyz[:, :2] - axis).T) for axis in axes], axis=0)
    near = []
    for low, high in pairwise((*DISTANCES_M, np.inf)):
        here = (away >= low) & (away < high)
        near.append(Confusion.of(taken[here], points.true[here]))
    kind, *_ = settings.kinds
    return Found((kind, settings.bundle, settings.density, settings.tension > 0), tuple(near))


def table(found: Sequence[Found]) -> list[str]:
    """A Markdown table: precision, recall at each distance; IoU of all points, and of the answer
    that every point is a conductor."""
    bands = [f"{low:g} to {high:g} m" for low, high in pairwise(DISTANCES_M)]
    bands = [f"{band}: precision, recall" for band in (*bands, f"from {DISTANCES_M[-1]:g} m")]
    head = ["towers", "wires", "pulses per m2", "tension", *bands, "IoU", "every point: IoU"]
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    for row in found:
        kind, bundle, density, tension = row.of
        total = sum(row.near, Confusion())
        cells = [kind, f"{bundle}", f"{density:g}", "yes" if tension else "no"]
        cells += [f"{two_digits(c.precision)}, {two_digits(c.recall)}" for c in row.near]
        cells += [two_digits(total.iou_tower), two_digits(every_point(total).iou_tower)]
        lines.append(f"| {' | '.join(cells)} |")
    return lines


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; its exit status."""
    parser = wire_parser("wires_at_towers", __doc__)
    add_kinds(parser)
    add_line(parser)
    parser.add_argument("--towers", type=int, default=3, help="of each survey (default 3)")
    parser.add_argument("--seed", type=int, default=5, help="of the first survey (default 5)")
    chosen = parser.parse_args(arguments)

    def make(folder: Path) -> list[str]:
        settings = cases(chosen.kinds, chosen.towers, chosen.seed)
        return table(
            [look_at_towers(of, chosen.model, folder, line=chosen.line) for of in settings]
        )

    return print_table(make)


if __name__ == "__main__":
    sys.exit(main())
