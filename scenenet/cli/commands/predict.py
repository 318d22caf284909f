"""``scenenet predict``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from scenenet.cli.inputs import Failures
from scenenet.cli.options import (
    AsJson,
    Kernels,
    MinConductor,
    ModelFile,
    Overwrite,
    Surveys,
    System,
    coordinate_system,
    detection_settings,
)
from scenenet.cli.output import show

EXAMPLES = (
    "scenenet predict line.laz --out predicted",
    "scenenet predict tiles/ --out predicted",
    "scenenet predict surveys/*.laz --model model.json --out predicted --json",
)


def command(
    surveys: Surveys,
    model: ModelFile,
    out: Annotated[Path, typer.Option("--out", help="Folder for the results.")],
    voxel_size: Annotated[
        float | None,
        typer.Option(
            min=0.01, help="Edge of a voxel in m.  [default: as the model was trained with]"
        ),
    ] = None,
    min_conductor: MinConductor = None,
    kernels: Kernels = None,
    crs: System = None,
    classify: Annotated[
        bool,
        typer.Option(
            "--classify", help="Give the points of towers the class code 15 (schemes asprs, edp)."
        ),
    ] = False,
    classify_from: Annotated[
        str | None,
        typer.Option(
            metavar="CODES",
            help="With --classify: the class codes that may become 15, such as 0,1,5.  [default: "
            "every code]",
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
    """Find the towers of surveys and classify every point.

    A survey is a file, a folder of LAS and LAZ files, a pattern such as 'tiles/*.laz' in quotes, or
    a tile index: a virtual point cloud (.vpc), a STAC item collection (.json) or a GeoPackage with
    a column location. Several files are one survey with one tower list, wherever it was cut.

    Each survey NAME gives these files in the folder --out:

    NAME.laz: all points of the survey, in order, each with the probability of a tower, the id of
    its tower (0 for none) and the share of each GENEO. A survey of several files has a folder NAME
    with a file for each, and status.csv with a row for each.

    NAME.gpkg: the towers, the coverage and the file as layers, in the CRS of the survey, with
    styles for QGIS.

    NAME.towers.csv, NAME.towers.geojson: the towers, with position, height, base elevation and
    probability, in the units of the survey. GeoJSON is in longitude and latitude where the CRS is
    known.

    NAME.html: a page with a map, the list of the towers, and each tower in plan and profile with
    its reasons and what to check. It needs no other file and no network.

    NAME.summary.json: counts, settings and time.

    A file that exists is replaced only if an earlier prediction wrote it and nothing changed it.

    The exit code is 1 if a survey fails; the other surveys are still predicted.
    """
    from scenenet.core.code_hash import code_hash
    from scenenet.core.errors import InputError
    from scenenet.core.outputs import check_outputs
    from scenenet.pointcloud.copc import require_pdal
    from scenenet.prediction import writers
    from scenenet.prediction.result_files import PredictionFiles, require_space
    from scenenet.prediction.settings import PredictSettings
    from scenenet.prediction.survey_files import SurveyFiles, look_at

    settings = PredictSettings(
        voxel_size=voxel_size, classify=classify, classify_from=_codes(classify, classify_from)
    )
    system = coordinate_system(crs)
    if copc:
        require_pdal()
    failures = Failures()
    named = failures.look_at(surveys, lambda given: SurveyFiles.of(given, system))
    files = {given: PredictionFiles.of(survey, out, copc=copc) for given, survey in named.items()}
    outputs = [output for each in files.values() for output in each.outputs()]
    inputs = [path for survey in named.values() for path in (survey.given, *survey.files)]
    check_outputs(outputs, [*inputs, model], overwrite=overwrite)
    seen = failures.look_at(named, lambda given: look_at(named[given])[0])
    if seen:  # it loads torch, which takes seconds
        from scenenet.models.model_file import read_model

        read_model(model)[1].threshold()
    points = {g: {path: i.n_points for path, i in headers.items()} for g, headers in seen.items()}
    require_space([(files[given], counts) for given, counts in points.items()])
    detection = detection_settings(min_conductor)
    tiled = any(named[given].tiled for given in seen)
    code = code_hash([writers.__file__]) if tiled else None
    summaries = []
    for given in seen:
        with failures.collect():
            summary = writers.predict_to_files(
                named[given], model, files[given], settings, detection, code
            )
            summaries.append(summary.to_json())
            for file in summary.files:
                if file["error"]:
                    failures.errors.append(InputError(file["error"]))
    show(
        summaries,
        as_json,
        lambda all_: [
            f"{s['survey']}: {s['towers']} towers among {s['points']:,} points" for s in all_
        ],
    )
    failures.end()


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
