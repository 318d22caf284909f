"""``scenenet synth``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from scenenet.cli.options import AsJson, Overwrite
from scenenet.cli.output import show

EXAMPLES = (
    "scenenet synth line.laz --towers 20 --seed 1 --truth truth.laz",
    "scenenet synth tiles/ --towers 300 --tiles 40",
)


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
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Make a synthetic survey of a power line, labelled with EDP class codes.

    The labels have the errors of hand-made labels; --truth keeps a copy without them, with --tiles
    in a folder of its own.

    A file that exists is replaced only if it is a synthetic survey.
    """
    from scenenet.core.outputs import Output, check_outputs
    from scenenet.synthetic import SyntheticSettings, is_synthetic_survey, make_survey, tile_names

    surveys = [path for path in (out, truth) if path is not None]
    names = [None] if tiles is None else tile_names(tiles)
    paths = [path if name is None else path / name for path in surveys for name in names]
    outputs = [Output(path, is_synthetic_survey) for path in paths]
    check_outputs(outputs, [], overwrite=overwrite)
    settings = SyntheticSettings(towers=towers, seed=seed)
    summary = make_survey(settings, out, truth=truth, progress=out.name, tiles=tiles)
    show(summary, as_json, lambda s: [f"{out}: {s['points']:,} points, {towers} towers"])
