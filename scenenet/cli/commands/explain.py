"""``scenenet explain``."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from scenenet.cli.options import (
    AsJson,
    Kernels,
    Measurements,
    MinConductor,
    ModelFile,
    Overwrite,
    Survey,
    System,
    coordinate_system,
    detection_settings,
)
from scenenet.cli.output import show

EXAMPLES = ("scenenet explain line.laz --out towers.html",)


def command(
    survey: Survey,
    model: ModelFile,
    out: Annotated[Path, typer.Option("--out", help="Page to write (.html).")],
    min_conductor: MinConductor = None,
    kernels: Kernels = None,
    measurements: Measurements = None,
    crs: System = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Write a page that explains every tower of a survey.

    Each tower has its measurements, the share of each GENEO, reasons to check it, and a picture.

    The page needs no other file and no network.

    A file that exists is replaced only if it is an explanation.
    """
    from scenenet.core.extras import require
    from scenenet.prediction.settings import PredictSettings

    require("report", "scenenet explain")  # before the prediction, which takes minutes
    from scenenet.core.outputs import Output, check_outputs
    from scenenet.prediction.survey_files import SurveyFiles
    from scenenet.report.explanation_page import explain_survey, is_explanation

    if out.suffix.lower() not in (".html", ".htm"):
        raise typer.BadParameter(
            f"an explanation is an .html file, such as {out / 'why.html'}", param_hint="--out"
        )
    named = SurveyFiles.of(survey, coordinate_system(crs))
    inputs = [survey, *named.files, model]
    check_outputs([Output(out, is_explanation)], inputs, overwrite=overwrite)
    detection = detection_settings(min_conductor)
    found = explain_survey(named, model, out, PredictSettings(), detection)
    show(
        [asdict(explanation) for explanation in found],
        as_json,
        lambda all_: [f"{out}: {len(all_)} towers explained"],
    )
