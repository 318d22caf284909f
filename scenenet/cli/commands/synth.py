"""``scenenet synth``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from scenenet.cli.options import AsJson, Overwrite
from scenenet.cli.output import show

EXAMPLES = (
    "scenenet synth line.laz --towers 20 --seed 1 --truth truth.laz",
    "scenenet synth line.laz --towers 12 --continuous",
    "scenenet synth tiles/ --towers 300 --tiles 40",
)

BEYOND_M = 30.0
"""m, of a survey without gaps beyond its first and last tower."""


def command(
    out: Annotated[Path, typer.Argument(help="Survey to write (.laz); with --tiles a folder.")],
    towers: Annotated[int, typer.Option(min=1, help="Number of towers.")] = 10,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same survey.")] = 0,
    truth: Annotated[
        Path | None,
        typer.Option(help="Second survey to write, with the labels before annotation noise."),
    ] = None,
    tiles: Annotated[
        int | None,
        typer.Option(
            min=1, help="Cut the survey across the line into so many files, in the folder OUT."
        ),
    ] = None,
    continuous: Annotated[
        bool,
        typer.Option(
            "--continuous",
            help="One survey without gaps that goes on beyond the first and the last tower. The "
            "default has gaps and ends at towers, as the files of TS40K do.",
        ),
    ] = False,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Make a synthetic, labelled survey of a power line.

    Its class codes are those of the scheme edp. The labels have the errors of hand-made labels;
    --truth keeps a copy without them, with --tiles in a folder of its own.

    A file that exists is replaced only if it is a synthetic survey.
    """
    from scenenet.core.outputs import Output, check_outputs
    from scenenet.synthetic import SyntheticSettings, is_synthetic_survey, make_survey, tile_names

    surveys = [path for path in (out, truth) if path is not None]
    names = [None] if tiles is None else tile_names(tiles)
    paths = [path if name is None else path / name for path in surveys for name in names]
    outputs = [Output(path, is_synthetic_survey) for path in paths]
    check_outputs(outputs, [], overwrite=overwrite)
    whole = {"section": 0, "margin": BEYOND_M} if continuous else {}
    settings = SyntheticSettings(towers=towers, seed=seed, **whole)
    replaced = any(output.path.exists() for output in outputs)
    summary = make_survey(settings, out, truth=truth, progress=out.name, tiles=tiles)
    done = f"{out}{' replaced' if replaced else ''}"
    counted = f"{towers} {'tower' if towers == 1 else 'towers'}"
    show(summary, as_json, lambda s: [f"{done}: {s['points']:,} points, {counted}"])
