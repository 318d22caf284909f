"""``scenenet predict``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from scenenet.cli.options import AsJson, MinConductor, ModelFile, Surveys, detection_settings
from scenenet.cli.output import show
from scenenet.core.errors import InputError

EXAMPLES = (
    "scenenet predict line.laz --model model.json --out predicted",
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
    as_json: AsJson = False,
) -> None:
    """Find the towers of surveys and classify every point.

    Each survey NAME gives three files in the folder --out:

    NAME.laz: all points of the survey, in order, each with the probability of a tower, the id of
    its tower (0 for none) and the share of each GENEO.

    NAME.towers.geojson: the towers, with position, height, base elevation (m) and probability.

    NAME.summary.json: counts, settings and time.
    """
    from scenenet.prediction.settings import PredictSettings
    from scenenet.prediction.writers import predict_to_files

    names = [survey.stem for survey in surveys]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise InputError(
            f"two surveys are called {', '.join(twice)} and would overwrite each other",
            remedy="Predict them one by one into different folders",
        )
    settings = PredictSettings(voxel_size=voxel_size)
    summaries = []
    for survey in surveys:
        target = out / f"{survey.stem.removesuffix('.copc')}.laz"
        if target.resolve() == survey.resolve():
            raise InputError(
                "the result would overwrite the survey", file=survey, remedy="Name another --out"
            )
        summary = predict_to_files(
            survey,
            model,
            target,
            target.with_suffix(".towers.geojson"),
            target.with_suffix(".summary.json"),
            settings,
            detection_settings(min_conductor),
        )
        summaries.append(summary.to_json())
    show(
        summaries,
        as_json,
        lambda all_: [
            f"{s['survey']}: {s['towers']} towers among {s['points']:,} points" for s in all_
        ],
    )
