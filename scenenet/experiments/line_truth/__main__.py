"""Lines that are found in synthetic surveys, against the truth.

    python -m scenenet.experiments.line_truth [--model WIRES] [--towers 24] [--seed 5] [--kinds ...]

makes a survey for each kind of tower, finds its towers and wires with the models of the package, or
its wires with WIRES, and compares the conductors, the clearances and the trees that could fall with
those of the survey. Prints two Markdown tables.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from scenenet.clearance.settings import ClearanceSettings
from scenenet.detection.settings import DetectionSettings
from scenenet.experiments.line_truth import clearances, conductors
from scenenet.experiments.wire_options import add_kinds, print_table, wire_parser
from scenenet.models.packaged import packaged_model
from scenenet.pointcloud.reading import read
from scenenet.prediction.predict import predict_survey
from scenenet.prediction.settings import PredictSettings
from scenenet.synthetic.corridor import Corridor
from scenenet.synthetic.settings import SyntheticSettings
from scenenet.synthetic.survey import make_survey

POLES: Mapping[str, Any] = {"density": 20.0}
PYLONS: Mapping[str, Any] = {
    "height": (22, 40), "span": 310, "span_spread": 30, "half_width": 40, "circuits": 2,
    "earth_wires": 1, "bundle": 2, "catenary": 1600, "clearing": 6, "relief": 60, "density": 12,
    "tower_density": 18, "flight_height": (90, 130), "high_strays": 0.02,
}  # fmt: skip
"""Settings of lines of poles and of pylons, as in docs/method/synthetic.md."""

SETTINGS: Mapping[str, Mapping[str, Any]] = {"lattice": PYLONS, "window": PYLONS}
"""Settings of the line by the kind of its towers; others are ``POLES``."""


def run(
    kind: str,
    towers: int,
    seed: int,
    wires: Path,
    voltage: float,
    folder: Path,
    tension: float = 0.0,
) -> tuple[conductors.Comparison, clearances.Comparison]:
    """Make the survey of a kind of tower, predict it, and compare.

    Raises:
        InputError: the model cannot be used, or there are no limits for the voltage.
    """
    own = {**SETTINGS.get(kind, POLES), "kinds": {kind: 1.0}, "section": 0, "margin": 30.0}
    settings = SyntheticSettings(**own, towers=towers, seed=seed, tension=tension)
    survey, truth = folder / f"{kind}.laz", folder / f"{kind}.truth.laz"
    make_survey(settings, survey, truth, progress=f"{kind}: survey made")
    limits = ClearanceSettings(voltage=voltage)
    models, corridor = [packaged_model(), wires], Corridor(settings)
    with predict_survey(
        survey, models, PredictSettings(), DetectionSettings(), clearance=limits
    ) as found:
        assert found.line is not None and found.clearances is not None
        cloud = read(truth)
        return (
            conductors.compare(kind, corridor, found.towers, found.line),
            clearances.compare(kind, corridor, cloud, found.line, found.clearances, limits),
        )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; its exit status."""
    parser = wire_parser("line_truth", __doc__)
    add_kinds(parser)
    parser.add_argument("--towers", type=int, default=24, help="towers of a line (default 24)")
    parser.add_argument("--seed", type=int, default=5, help="of the surveys (default 5)")
    parser.add_argument("--voltage", type=float, default=66, help="kV, of the limits (default 66)")
    parser.add_argument(
        "--tension",
        type=float,
        default=0.0,
        help="share of towers on straight stretches that end their conductors; bends do then too "
        "(default 0)",
    )
    chosen = parser.parse_args(arguments)
    how = chosen.towers, chosen.seed, chosen.model, chosen.voltage

    def make(folder: Path) -> list[str]:
        found = [run(kind, *how, folder, chosen.tension) for kind in chosen.kinds]
        lines, near = zip(*found, strict=True)
        return [*conductors.table(lines), "", *clearances.table(near)]

    return print_table(make)


if __name__ == "__main__":
    sys.exit(main())
