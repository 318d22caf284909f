"""``scenenet synth``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from scenenet.cli.options import AsJson
from scenenet.cli.output import show

EXAMPLES = ("scenenet synth line.laz --towers 20 --seed 1 --truth truth.laz",)


def command(
    out: Annotated[Path, typer.Argument(help="Survey to write (.laz).")],
    towers: Annotated[int, typer.Option(min=1, help="Number of towers.")] = 10,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same survey.")] = 0,
    truth: Annotated[
        Path | None,
        typer.Option(help="Second survey to write, with the labels before annotation noise."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Make a synthetic survey of a power line, labelled with EDP class codes.

    The labels have the errors of hand-made labels; --truth keeps a copy without them.
    """
    from scenenet.synthetic import SyntheticSettings, make_survey

    settings = SyntheticSettings(towers=towers, seed=seed)
    summary = make_survey(settings, out, truth=truth, progress=out.name)
    show(summary, as_json, lambda s: [f"{out}: {s['points']:,} points, {towers} towers"])
