"""Lines that are found in synthetic surveys, against the truth.

    python -m scenenet.experiments.line_truth [--model WIRES] [--towers 24] [--seed 5] [--kinds ...]

makes a survey for each kind of tower, finds its towers and wires with the models of the package, or
its wires with WIRES, and compares the conductors, the clearances and the trees that could fall with
those of the survey. Prints two Markdown tables.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from scenenet.clearance.settings import ClearanceSettings
from scenenet.detection.settings import DetectionSettings
from scenenet.experiments.line_truth import clearances, conductors
from scenenet.experiments.line_truth.lines import add_line, line_of
from scenenet.experiments.wire_options import print_table, wire_parser
from scenenet.models.packaged import packaged_model
from scenenet.pointcloud.reading import read
from scenenet.prediction.predict import predict_survey
from scenenet.prediction.settings import PredictSettings
from scenenet.synthetic.corridor import Corridor
from scenenet.synthetic.survey import make_survey


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
    settings = line_of(kind, towers, seed, tension)
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
    add_line(parser, towers=24)
    parser.add_argument("--voltage", type=float, default=66, help="kV, of the limits (default 66)")
    chosen = parser.parse_args(arguments)
    how = chosen.towers, chosen.seed, chosen.model, chosen.voltage

    def make(folder: Path) -> list[str]:
        found = [run(kind, *how, folder, chosen.tension) for kind in chosen.kinds]
        lines, near = zip(*found, strict=True)
        return [*conductors.table(lines), "", *clearances.table(near)]

    return print_table(make)


if __name__ == "__main__":
    sys.exit(main())
