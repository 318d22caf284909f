"""``scenenet predict``."""

from __future__ import annotations

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
from scenenet.models.packaged import WIRES, packaged_model
from scenenet.pointcloud.class_schemes import SCHEMES, ClassScheme, class_scheme
from scenenet.pointcloud.targets import WIRE, Target

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from scenenet.clearance.settings import ClearanceSettings
    from scenenet.prediction.result_files import PredictionFiles
    from scenenet.prediction.settings import PredictSettings
    from scenenet.prediction.survey_files import SurveyFiles
    from scenenet.prediction.used_models import UsedModel

EXAMPLES = (
    "scenenet predict line.laz --out predicted",
    "scenenet predict tiles/ --out predicted",
    "scenenet predict surveys/*.laz --model model.json --out predicted --json",
    "scenenet predict line.laz --line --out predicted",
    "scenenet predict line.laz --model model.json --model wire.json --out predicted",
)


_WIRE_CODES = ", ".join(f"{name} {each.main_code('conductor')}" for name, each in SCHEMES.items())


def command(
    surveys: Surveys,
    model: ModelFiles,
    out: Annotated[Path, typer.Option("--out", help="Folder for the results.")],
    line: Annotated[
        bool,
        typer.Option(
            "--line",
            help="Find spans and conductors and measure clearances too, with the model of wires "
            "that comes with the package unless --model names one of target wire.",
        ),
    ] = False,
    voxel_size: Annotated[
        float | None,
        typer.Option(
            min=0.01, help="Edge of a voxel in m.  [default: as the model was trained with]"
        ),
    ] = None,
    min_conductor: MinConductor = None,
    kernels: Kernels = None,
    measurements: Measurements = None,
    crs: System = None,
    classify: Annotated[
        bool,
        typer.Option(
            "--classify",
            help="Give the points of towers the class code 15 (schemes asprs, edp), and with "
            "--line or a model of target wire the points of wires that of --codes.",
        ),
    ] = False,
    codes: Annotated[
        Codes | None,
        typer.Option(
            "--codes",
            help="Class scheme of the survey, with --line or a model of target wire: its classes "
            "say what is near the conductors, and with --classify wires get its code "
            f"({_WIRE_CODES}).",
        ),
    ] = None,
    classify_from: Annotated[
        str | None,
        typer.Option(
            metavar="CODES",
            help="With --classify: the class codes that may be replaced, such as 0,1,5.  [default: "
            "every code]",
        ),
    ] = None,
    voltage: Annotated[
        float | None,
        typer.Option(
            metavar="KV",
            min=0.1,
            help="With --line, or models of towers and wires: nominal voltage of the lines in kV, "
            "by which limits for clearances are chosen.  [default: no limits]",
        ),
    ] = None,
    limits: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="With --voltage: limits for clearances (CSV) with the columns "
            f"{columns_of_table(ClearanceLimits)}.  [default: examples, docs/guides/clearances.md]",
        ),
    ] = None,
    sags: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Clearances at another temperature: catenary parameters of spans (CSV) with the "
            f"columns {columns_of_table(SpanSag)}.  [default: as flown]",
        ),
    ] = None,
    copc: Annotated[
        bool,
        typer.Option(
            "--copc", help="Write the points as COPC too (NAME.copc.laz). Needs the program pdal."
        ),
    ] = False,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Find the towers of surveys, or another target of a model, and classify every point.

    A survey is a file, a folder of LAS and LAZ files, a pattern such as 'tiles/*.laz' in quotes, or
    a tile index: a virtual point cloud (.vpc), a STAC item collection (.json) or a GeoPackage with
    a column location. Several files are one survey with one tower list, wherever it was cut.

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
    from scenenet.pointcloud.copc import require_pdal
    from scenenet.prediction import writers
    from scenenet.prediction.result_files import PredictionFiles
    from scenenet.prediction.settings import PredictSettings
    from scenenet.prediction.survey_files import SurveyFiles

    settings = PredictSettings(
        voxel_size=voxel_size, classify=classify, classify_from=_codes(classify, classify_from)
    )
    scheme = None if codes is None else class_scheme(codes.value)
    system = coordinate_system(crs)
    if copc:
        require_pdal()
    clearance = _clearance(voltage, limits, sags)
    failures = Failures()
    named = failures.look_at(surveys, lambda given: SurveyFiles.of(given, system))
    towers, lines = True, line
    if named and (line or model != [packaged_model()]):  # it loads torch, which takes seconds
        model, towers, lines = _chosen(model, line, settings, scheme)
    if named and not lines:
        _refuse_without_lines({"--line": line, "--voltage": voltage, "--sags": sags})
    results = {
        given: PredictionFiles.of(survey, out, copc=copc, towers=towers, line=lines)
        for given, survey in named.items()
    }
    ready = _ready(named, results, model, overwrite, failures)
    detection = detection_settings(min_conductor)
    tiled = any(named[given].tiled for given in ready)
    code = code_hash([writers.__file__]) if tiled else None
    summaries = []
    for given in ready:
        with failures.collect():
            summary = writers.predict_to_files(
                named[given], model, results[given], settings, detection, code, scheme, clearance
            )
            summaries.append(summary.to_json())
            for file in summary.files:
                if file["error"]:
                    failures.errors.append(InputError(file["error"]))
    show(summaries, as_json, lambda all_: [_line(summary) for summary in all_])
    failures.end()


def _ready(
    named: Mapping[Path, SurveyFiles],
    results: Mapping[Path, PredictionFiles],
    models: Sequence[Path],
    overwrite: bool,
    failures: Failures,
) -> list[Path]:
    """The surveys that can be predicted, after a look at their headers, at the files that would be
    replaced and at the space on the disks."""
    from scenenet.core.outputs import check_outputs
    from scenenet.prediction.result_files import require_space
    from scenenet.prediction.survey_files import look_at

    outputs = [output for each in results.values() for output in each.outputs()]
    inputs = [path for survey in named.values() for path in (survey.given, *survey.files)]
    check_outputs(outputs, [*inputs, *models], overwrite=overwrite)
    seen = failures.look_at(named, lambda given: look_at(named[given])[0])
    points = {g: {path: i.n_points for path, i in headers.items()} for g, headers in seen.items()}
    require_space([(results[given], counts) for given, counts in points.items()], len(models))
    return list(seen)


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
    return line if summary["towers"] is not None else f"{line}; towers were not looked for"


def _clearance(voltage: float | None, limits: Path | None, sags: Path | None) -> ClearanceSettings:
    """How clearances are measured.

    Raises:
        typer.BadParameter: there are limits, and no voltage.
        InputError: the limits or sags cannot be used, or there is no limit for the voltage.
    """
    from scenenet.clearance.limits_file import read_limits
    from scenenet.clearance.sags import read_sags
    from scenenet.clearance.settings import ClearanceSettings

    if limits is not None and voltage is None:
        raise typer.BadParameter("needs --voltage", param_hint="--limits")
    given: dict[str, Any] = {} if limits is None else {"limits": read_limits(limits)}
    if sags is not None:
        given["sags"] = read_sags(sags)
    settings = ClearanceSettings(voltage=voltage, **given)
    settings.applied()  # fail before the work
    return settings


def _chosen(
    models: list[Path], line: bool, settings: PredictSettings, scheme: ClassScheme | None
) -> tuple[list[Path], bool, bool]:
    """The models that predict, with that of wires that ``--line`` asks for; whether they find
    towers, and whether lines follow from what they find."""
    from scenenet.prediction.used_models import finds_lines, use_models

    used = use_models(models, settings, scheme)
    if line and not any(each.target.name == WIRE for each in used):
        models = [*models, packaged_model(WIRES)]
        used = use_models(models, settings, scheme)
    _require_codes(used, settings, scheme)
    return models, used[0].target.is_tower, finds_lines(used)


def _refuse_without_lines(options: Mapping[str, object]) -> None:
    """Refuse the options that need lines where no line is looked for.

    Raises:
        typer.BadParameter: one is given.
    """
    for option, value in options.items():
        if value:
            needed = (
                "a model of towers (--model)"
                if option == "--line"
                else "--line, or a model of towers and one of target wire (--model, twice)"
            )
            raise typer.BadParameter(f"needs {needed}", param_hint=option)


def _require_codes(
    used: Sequence[UsedModel], settings: PredictSettings, scheme: ClassScheme | None
) -> None:
    """Refuse to classify wires without the scheme that has their code.

    Raises:
        typer.BadParameter: there is a model of wires, and no scheme.
    """
    if settings.classify and scheme is None and any(each.target.name == WIRE for each in used):
        raise typer.BadParameter(
            "--classify with a model of target wire needs the class scheme of the survey "
            f"({_WIRE_CODES})",
            param_hint="--codes",
        )


def _codes(classify: bool, text: str | None) -> tuple[int, ...] | None:
    """The class codes of ``--classify-from``."""
    if text is None:
        return None
    if not classify:
        raise typer.BadParameter("needs --classify", param_hint="--classify-from")
    codes = [part.strip() for part in text.split(",")]
    if not all(code.isdecimal() and int(code) < 256 for code in codes):
        raise typer.BadParameter(
            f"{text!r} is not a list of class codes from 0 to 255, such as 0,1,5",
            param_hint="--classify-from",
        )
    return tuple(int(code) for code in codes)
