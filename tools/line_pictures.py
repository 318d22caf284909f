"""The pictures of conductors in the documentation: ``python tools/line_pictures.py``.

Makes a synthetic line of pylons, finds its line with the models of the package, draws the
conductors over the points, and opens the page of the survey in Chromium: ``docs/images/line.png``
and ``spans.png``. With real recordings (``SCENENET_REAL_DATA``, or ``shared/data`` beside the
project) it draws the Dutch corridor as well, into ``results/line``: nothing that comes from a
recording is part of the project.
"""

from __future__ import annotations

import argparse
import io
import os
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from doc_pictures import IMAGES, chromium, save, take_spans

from scenenet.core.errors import InputError
from scenenet.figures.plots.style import COLOURS, DPI, TOWER_COLOUR, new_figure
from scenenet.line.frame import SpanFrame
from scenenet.models.packaged import WIRES, packaged_model
from scenenet.prediction.result_files import PredictionFiles

if TYPE_CHECKING:
    import pyproj
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ROOT = Path(__file__).resolve().parent.parent
REAL = Path(os.environ.get("SCENENET_REAL_DATA", ROOT.parent / "shared" / "data"))
TILE, TILE_CRS = REAL / "corridor" / "07CZ2_14.laz", "EPSG:7415"
"""The Dutch corridor, and its coordinate system, which the file does not name."""

PYLONS = {
    "towers": 3, "seed": 4, "kinds": {"lattice": 1}, "height": (28, 40), "span": 310,
    "span_spread": 30, "half_width": 40, "section": 0, "margin": 40, "circuits": 2,
    "earth_wires": 1, "bundle": 2, "catenary": 1600, "bend_share": 0.4, "clearing": 6,
    "relief": 20, "density": 12, "tower_density": 18, "flight_height": (90, 130),
    "high_strays": 0.02,
}  # fmt: skip
"""Settings of the synthetic line."""

VOLTAGE = 220.0
"""kV, for the limits on the page of its survey."""

MOST_POINTS = 60_000
"""Points of a panel, at most."""

BESIDE_M, BEYOND_M = 20.0, 30.0
"""m to both sides of a span, and beyond its ends, from which its profile shows points."""

STYLES = {"conductor": "-", "earth wire": "--", "cable": ":"}
WIRE_WIDTH = 1.2
GREY = "#B5B5B5"


@dataclass(frozen=True)
class FoundLine:
    """What a prediction found, in the coordinates of the survey.

    Attributes:
        xyz: (N, 3) m, the points of the survey.
        spans, conductors, towers: column -> values of each layer of the GeoPackage.
        wires: (k, 3) m, the vertices of each conductor.
        ends: (2, 2) m, start and end of each span.
    """

    xyz: np.ndarray
    spans: Mapping[str, np.ndarray]
    conductors: Mapping[str, np.ndarray]
    towers: Mapping[str, np.ndarray]
    wires: Sequence[np.ndarray]
    ends: Sequence[np.ndarray]

    @classmethod
    def of(cls, files: PredictionFiles) -> FoundLine:
        """The results of a survey of one file, whose unit is the metre."""
        import laspy

        (path,) = files.points.values()
        spans, ends = _layer(files.geopackage, "spans")
        conductors, wires = _layer(files.geopackage, "conductors")
        towers, _ = _layer(files.geopackage, "towers")
        return cls(np.array(laspy.read(path).xyz), spans, conductors, towers, wires, ends)

    def fullest(self) -> int:
        """Row of the span with most wires, of these the longest.

        Raises:
            InputError: no span was found.
        """
        if not self.ends:
            raise InputError("the prediction has no span", remedy="Try another model of wires")
        wires = self.spans["conductors"] + self.spans["earth_wires"]
        return int(np.lexsort((self.spans["length"], wires))[-1])


def _layer(path: Path, name: str) -> tuple[dict[str, np.ndarray], list[np.ndarray]]:
    """Columns of a layer of a GeoPackage, and the vertices of each of its rows."""
    import pyogrio
    import shapely

    info, _, shapes, values = pyogrio.raw.read(path, layer=name)
    vertices = [
        shapely.get_coordinates(shape, include_z=True) for shape in shapely.from_wkb(shapes)
    ]
    return dict(zip(info["fields"], values, strict=True)), vertices


def draw(found: FoundLine) -> Figure:
    """All conductors in plan, and those of the span with most of them in profile."""
    row = found.fullest()
    frame = SpanFrame.between(*found.ends[row][:, :2])
    figure, axes = new_figure(2, 1, width=9.5, height=6.2, height_ratios=(1, 1.9))
    plan, profile = axes[:, 0]
    _plan(plan, found, frame)
    _profile(profile, found, frame, int(found.spans["span_id"][row]))
    return figure


def _plan(axis: Axes, found: FoundLine, frame: SpanFrame) -> None:
    stz = frame.to_frame(found.xyz)
    _points(axis, stz[:, 0], stz[:, 1])
    for number, wire in enumerate(found.wires):
        s, t, _ = frame.to_frame(wire).T
        _wire(axis, s, t, found, number)
    places = np.column_stack((found.towers["x"], found.towers["y"], found.towers["base"]))
    s, t, _ = frame.to_frame(places).T
    axis.plot(s, t, "^", color=TOWER_COLOUR, mec="white", ms=9, label="tower", zorder=4)
    axis.set_aspect("equal")
    axis.set(xlabel="along the span, m", ylabel="to its left, m")
    axis.set_title("Plan", loc="left")
    for kind, style in STYLES.items():
        if kind in found.conductors["kind"]:
            axis.plot([], [], style, color="black", lw=WIRE_WIDTH, label=kind)
    axis.legend(frameon=False, fontsize=9, ncols=4, loc="lower right", bbox_to_anchor=(1, 1))


def _profile(axis: Axes, found: FoundLine, frame: SpanFrame, span_id: int) -> None:
    s, t, z = frame.to_frame(found.xyz).T
    near = (np.abs(t) <= BESIDE_M) & (s >= -BEYOND_M) & (s <= frame.length + BEYOND_M)
    _points(axis, s[near], z[near])
    own = np.flatnonzero(found.conductors["span_id"] == span_id)
    for number in own:
        along, _, height = frame.to_frame(found.wires[number]).T
        _wire(axis, along, height, found, number)
    places = np.column_stack((found.towers["x"], found.towers["y"], found.towers["base"]))
    tops = found.towers["height"]
    for (along, beside, base), height in zip(frame.to_frame(places), tops, strict=True):
        if abs(beside) <= BESIDE_M and -BEYOND_M <= along <= frame.length + BEYOND_M:
            axis.plot([along, along], [base, base + height], color=TOWER_COLOUR, lw=3, alpha=0.5)
    highest = max(found.wires[number][:, 2].max() for number in own)
    axis.set(
        xlabel="along the span, m", ylabel="elevation, m",
        ylim=(np.percentile(z[near], 0.5) - 2, highest + 6),
    )  # fmt: skip
    axis.set_title(f"Profile of span {span_id}", loc="left")


def _points(axis: Axes, x: np.ndarray, y: np.ndarray) -> None:
    """At most ``MOST_POINTS`` of the points, evenly drawn."""
    rows = np.arange(len(x))
    if len(rows) > MOST_POINTS:
        rows = np.random.default_rng(0).choice(rows, MOST_POINTS, replace=False)
    axis.plot(x[rows], y[rows], ",", color=GREY, rasterized=True)


def _wire(axis: Axes, x: np.ndarray, y: np.ndarray, found: FoundLine, number: int) -> None:
    """The conductor in row ``number``."""
    colour = COLOURS[(int(found.conductors["conductor_id"][number]) - 1) % len(COLOURS)]
    style = STYLES[found.conductors["kind"][number]]
    axis.plot(x, y, style, color=colour, lw=WIRE_WIDTH, zorder=3)


def write(figure: Figure, out: Path) -> None:
    """Write a picture as a PNG with a palette."""
    image = io.BytesIO()
    figure.savefig(image, dpi=DPI, facecolor="white")
    out.parent.mkdir(parents=True, exist_ok=True)
    save(image.getvalue(), out)


def predict(
    survey: Path, wire: Path, crs: pyproj.CRS | None, folder: Path, voltage: float | None = None
) -> PredictionFiles:
    """Predict a survey with the model of the package and a model of wires."""
    from scenenet.clearance.settings import ClearanceSettings
    from scenenet.detection.settings import DetectionSettings
    from scenenet.prediction.settings import PredictSettings
    from scenenet.prediction.survey_files import SurveyFiles
    from scenenet.prediction.writers import predict_to_files

    given = SurveyFiles.of(survey, crs)
    files = PredictionFiles.of(given, folder, line=True)
    models = [packaged_model(), wire]
    clearance = ClearanceSettings(voltage=voltage)
    predict_to_files(
        given, models, files, PredictSettings(), DetectionSettings(), clearance=clearance
    )
    return files


def take_synthetic(wire: Path, out: Path) -> None:
    """The synthetic line, and the page of its survey."""
    from scenenet.synthetic import SyntheticSettings, make_survey

    with tempfile.TemporaryDirectory() as scratch:
        survey = Path(scratch) / "line.laz"
        make_survey(SyntheticSettings(**PYLONS), survey)
        files = predict(survey, wire, None, Path(scratch) / "found", VOLTAGE)
        write(draw(FoundLine.of(files)), out / "line.png")
        if chromium() is None or files.page is None:
            raise InputError("there is no Chromium", remedy="apt install chromium")
        take_spans(files.page, out)


def take_real(wire: Path, out: Path) -> None:
    """The Dutch corridor."""
    import pyproj

    with tempfile.TemporaryDirectory() as scratch:
        files = predict(TILE, wire, pyproj.CRS(TILE_CRS), Path(scratch))
        write(draw(FoundLine.of(files)), out / f"{TILE.stem}.png")


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    wires = packaged_model(WIRES)
    parser.add_argument("--wire", type=Path, default=wires, help="another model of wires")
    parser.add_argument("--out", type=Path, default=IMAGES, help="where the synthetic one goes")
    parser.add_argument(
        "--real", type=Path, default=ROOT / "results" / "line", help="where the real one goes"
    )
    asked = parser.parse_args(arguments)
    try:
        take_synthetic(asked.wire, asked.out)
        if TILE.is_file():
            take_real(asked.wire, asked.real)
        else:
            print("skipped: no real recordings here; set SCENENET_REAL_DATA", file=sys.stderr)
    except InputError as error:
        sys.exit(f"Error: {error}")


if __name__ == "__main__":
    main()
