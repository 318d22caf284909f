"""``scenenet predict``."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from scenenet.clearance.settings import ClearanceLimits, SpanSag
from scenenet.clearance.settings_table import columns_of_table
from scenenet.cli.inputs import Failures
from scenenet.cli.options import (
    AsJson,
    Codes,
    Kernels,
    Measurements,
    MinConductor,
    ModelFiles,
    Overwrite,
    Surveys,
    System,
    coordinate_system,
    detection_settings,
)
from scenenet.cli.output import show
from scenenet.cli.predicted_surveys import (
    WIRE_CODES,
    chosen_models,
    clearance_settings,
    ready_surveys,
    refuse_without_lines,
    rejected_conductors,
    replaceable_codes,
)
from scenenet.models.packaged import packaged_model
from scenenet.pointcloud.class_schemes import class_scheme
from scenenet.pointcloud.targets import Target

if TYPE_CHECKING:
    from scenenet.prediction.result_files import PredictionFiles

EXAMPLES = (
    "scenenet predict line.laz --out predicted",
    "scenenet predict tiles/ --out predicted",
    "scenenet predict surveys/*.laz --model model.json --out predicted --json",
    "scenenet predict line.laz --line --out predicted",
    "scenenet predict line.laz --model model.json --model wire.json --out predicted",
)

Out = Annotated[Path, typer.Option("--out", help="Folder for the results.")]
Line = Annotated[
    bool,
    typer.Option(
        "--line",
        help="Find spans and conductors and measure clearances too, with the model of wires "
        "that comes with the package unless --model names one of target wire.",
    ),
]
VoxelSize = Annotated[
    float | None,
    typer.Option(min=0.01, help="Edge of a voxel in m.  [default: as the model was trained with]"),
]
Classify = Annotated[
    bool,
    typer.Option(
        "--classify",
        help="Give the points of towers the class code 15 (schemes asprs, edp), and with "
        "--line or a model of target wire the points of wires that of --codes.",
    ),
]
ClassCodes = Annotated[
    Codes | None,
    typer.Option(
        "--codes",
        help="Class scheme of the survey, with --line or a model of target wire: its classes "
        "say what is near the conductors, and with --classify wires get its code "
        f"({WIRE_CODES}).",
    ),
]
ClassifyFrom = Annotated[
    str | None,
    typer.Option(
        metavar="CODES",
        help="With --classify: the class codes that may be replaced, such as 0,1,5.  [default: "
        "every code]",
    ),
]
Voltage = Annotated[
    float | None,
    typer.Option(
        metavar="KV",
        min=0.1,
        help="With --line, or models of towers and wires: nominal voltage of the lines in kV, "
        "by which limits for clearances are chosen.  [default: no limits]",
    ),
]
Limits = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="With --voltage: limits for clearances (CSV) with the columns "
        f"{columns_of_table(ClearanceLimits)}.  [default: examples, docs/guides/clearances.md]",
    ),
]
Sags = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="Clearances at another temperature: catenary parameters of spans (CSV) with the "
        f"columns {columns_of_table(SpanSag)}.  [default: as flown]",
    ),
]
Decisions = Annotated[
    list[Path] | None,
    typer.Option(
        "--decisions",
        metavar="FILE",
        help="Review file (scenenet review): conductors that it rejects are left out. May be "
        "repeated; for one survey.",
    ),
]
Copc = Annotated[
    bool,
    typer.Option(
        "--copc", help="Write the points as COPC too (NAME.copc.laz). Needs the program pdal."
    ),
]


def command(
    surveys: Surveys,
    model: ModelFiles,
    out: Out,
    line: Line = False,
    voxel_size: VoxelSize = None,
    min_conductor: MinConductor = None,
    kernels: Kernels = None,
    measurements: Measurements = None,
    crs: System = None,
    classify: Classify = False,
    codes: ClassCodes = None,
    classify_from: ClassifyFrom = None,
    voltage: Voltage = None,
    limits: Limits = None,
    sags: Sags = None,
    decisions: Decisions = None,
    copc: Copc = False,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Find the towers of surveys and classify every point.

    Models of other targets (--model) find other objects.

    A survey is a file, a folder of LAS and LAZ files, a pattern such as 'tiles/*.laz' in quotes, or
    a tile index: a virtual point cloud (.vpc, .vpz), a STAC item collection (.json) or a GeoPackage
    with a column location. Several files are one survey with one tower list, wherever it was cut.

    Each survey NAME gives these files in the folder --out:

    NAME.laz: all points of the survey, in order, each with the probability of a tower, the id of
    its tower (0 for none) and the share of each GENEO. A model of another target gives
    TARGET_probability and TARGET_GENEO. A survey of several files has a folder NAME with a file for
    each, and status.csv with a row for each.

    NAME.gpkg: the towers, the coverage and the file as layers, in the CRS of the survey, with
    styles for QGIS.

    NAME.towers.csv, NAME.towers.geojson: the towers, with position, height, base elevation and
    probability, in the units of the survey. GeoJSON is in longitude and latitude where the CRS is
    known.

    NAME.spans.csv, NAME.conductors.csv: with --line, or a model of towers and one of wires, the
    spans in order along each line, and every conductor with its catenary, sag and attachments.
    NAME.gpkg then has the layers spans, conductors and line_notes, and each point the numbers of
    its span and conductor. Positions are those of the flight, not those at another temperature,
    load or wind.

    NAME.clearances.csv: with these options, a row per span, the worst first: how near ground,
    vegetation, buildings and other wires are to its conductors, and with --voltage how many places
    are closer than the limits. NAME.gpkg then has the layers clearances,
    clearance_profile and fall_trees.

    --decisions leaves conductors out that people rejected in a review file: of all of these files,
    of the page and of the points. The layer rejected_conductors has them. What was taken for one
    counts as an obstacle then.

    NAME.html: a page with a map, the list of the towers, and each tower in plan and profile with
    its reasons and what to check. It needs no other file and no network.

    NAME.summary.json: counts, settings and time.

    Without a model of towers there is no list of towers and no page, and the number of towers in
    the summary is null.

    A file that exists is replaced only if an earlier prediction wrote it and nothing changed it.

    The exit code is 1 if a survey fails; the other surveys are still predicted.
    """
    from scenenet.core.code_hash import code_hash
    from scenenet.core.errors import InputError
    from scenenet.core.gdal import leave_out_data_frames
    from scenenet.pointcloud.copc import require_pdal
    from scenenet.prediction import writers
    from scenenet.prediction.result_files import PredictionFiles
    from scenenet.prediction.settings import PredictSettings
    from scenenet.prediction.survey_files import SurveyFiles

    leave_out_data_frames()
    settings = PredictSettings(
        voxel_size=voxel_size,
        classify=classify,
        classify_from=replaceable_codes(classify, classify_from),
    )
    scheme = None if codes is None else class_scheme(codes.value)
    system = coordinate_system(crs)
    if copc:
        require_pdal()
    if decisions and len(surveys) > 1:
        raise typer.BadParameter("belongs to one survey", param_hint="--decisions")
    rejects = rejected_conductors(decisions)
    clearance = clearance_settings(voltage, limits, sags)
    failures = Failures()
    named = failures.look_at(surveys, lambda given: SurveyFiles.of(given, system))
    towers, lines = True, line
    if named and (line or model != [packaged_model()]):  # it loads torch, which takes seconds
        model, towers, lines = chosen_models(model, line, settings, scheme)
    if named and not lines:
        needing = {"--voltage": voltage, "--sags": sags, "--decisions": decisions}
        refuse_without_lines({"--line": line, **needing})
    results = {
        given: PredictionFiles.of(survey, out, copc=copc, towers=towers, line=lines)
        for given, survey in named.items()
    }
    ready = ready_surveys(named, results, model, overwrite, failures)
    detection = detection_settings(min_conductor)
    tiled = any(named[given].tiled for given in ready)
    code = code_hash([writers.__file__]) if tiled else None
    summaries, done = [], []
    for given in ready:
        with failures.collect():
            summary = writers.predict_to_files(
                named[given], model, results[given], settings, detection, code, scheme, clearance,
                rejects,
            )  # fmt: skip
            summaries.append(summary.to_json())
            for file in summary.files:
                if file["error"]:
                    failures.errors.append(InputError(file["error"]))
            done.append(given)
    show(
        summaries,
        as_json,
        lambda all_: [
            f"{_line(summary)}{_where(results[given])}"
            for given, summary in zip(done, all_, strict=True)
        ],
    )
    failures.end()


def _where(results: PredictionFiles) -> str:
    """What to open."""
    status = f"; of each file: {results.status}" if results.status else ""
    if results.page is None:
        return f"; results in {results.summary.parent}{status}"
    return f"; open {results.page}{status}"


def _line(summary: dict[str, Any]) -> str:
    """What was found in a survey, in a line."""
    found = [] if summary["towers"] is None else [f"{summary['towers']} towers"]
    for each in summary["targets"]:
        target = Target.parse(each["target"])
        if not target.is_tower:
            found.append(f"{each['points']:,} {target.name} points")
    if summary["line"] is not None:
        wires = summary["line"]
        found.append(f"{wires['spans']} spans with {wires['conductors']} conductors")
        if wires["clearances"] and wires["clearances"]["dangers"]:
            found.append(f"{wires['clearances']['dangers']} places closer than the limits")
        if wires["to_look_at"]:
            found.append(f"{wires['to_look_at']} places to look at (layer line_notes)")
    line = f"{summary['survey']}: {', '.join(found)} among {summary['points']:,} points"
    status = Counter(file["status"] for file in summary["files"])
    if status.total() > status["predicted"]:
        others = [f"{status[name]} {name}" for name in ("failed", "left out") if status[name]]
        line += f"; {status['predicted']} of {status.total()} files predicted, {', '.join(others)}"
    return line if summary["towers"] is not None else f"{line}; towers were not looked for"
