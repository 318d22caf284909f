"""``scenenet evaluate``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from scenenet.cli.inputs import Failures
from scenenet.cli.options import (
    RESOLUTION,
    AsJson,
    Fits,
    Kernels,
    LabelCodes,
    Labelled,
    Measurements,
    MinConductor,
    ModelFile,
    Resolution,
    cube,
    detection_settings,
    target_of,
)
from scenenet.cli.output import score_lines, show

EXAMPLES = (
    "scenenet evaluate labelled.laz --model model.json --codes edp",
    "scenenet evaluate labelled.laz --model model.json --codes asprs --fit metric",
    "scenenet evaluate labelled.laz --model wires --codes asprs --line",
    "scenenet evaluate line.laz --model model.json --codes edp --truth line.truth.laz",
)

GRID_OF_THE_THESIS = Fits("cube")


def command(
    labelled: Labelled,
    model: ModelFile,
    codes: LabelCodes,
    fit: Annotated[
        Fits,
        typer.Option(
            help="cube: a grid over the bounding cube of each crop, as in the thesis. metric: the "
            "voxel size of the model; towers are searched for in whole surveys."
        ),
    ] = GRID_OF_THE_THESIS,
    resolution: Resolution = RESOLUTION,
    truth: Annotated[
        list[Path] | None,
        typer.Option(
            help="The same points in the same order with their true classes, as scenenet synth "
            "--truth writes. Give one for each labelled file, in their order. Every score is then "
            "given against the labels and against the truth."
        ),
    ] = None,
    target: Annotated[
        str | None,
        typer.Option(
            metavar="TARGET",
            help="What the model finds, with its class codes in these files, such as wire=14. "
            "[default: the target of the model]",
        ),
    ] = None,
    line: Annotated[
        bool,
        typer.Option(
            "--line",
            help="For a model of wires: find towers and conductors too, as scenenet predict --line "
            "does. The points of conductors then count as wires, whatever their voxels are.",
        ),
    ] = False,
    min_conductor: MinConductor = None,
    kernels: Kernels = None,
    measurements: Measurements = None,
    as_json: AsJson = False,
) -> None:
    """Score a model on labelled surveys or crops.

    The voxel scores are precision, recall, F0.5 and IoU at the threshold tau of the model.

    A predicted tower within 5 m of a labelled one is a true positive.

    The point scores compare the points to which scenenet predict gives a tower id with the points
    labelled tower: all points of each file, whatever --fit is. For a model of another target they
    compare the points in voxels at or above tau with the points labelled with the target, and there
    are no tower scores. With --line the points of conductors count too.

    The exit code is 1 if a file fails; the other files are still scored.
    """
    from scenenet.cli.scored_files import evaluate_files

    truths = truth or []
    if truths and len(truths) != len(labelled):
        raise typer.BadParameter(
            f"{len(truths)} for {len(labelled)} labelled files; give one for each, in their order",
            param_hint="--truth",
        )
    finds = None if target is None else target_of(target)
    grid = cube(resolution) if fit.value == "cube" else None
    detection = detection_settings(min_conductor)
    failures = Failures()
    result = evaluate_files(
        labelled, model, codes.value, grid, detection, failures, truths, finds, line=line
    )
    for skipped in result["skipped"]:
        print(f"not scored: {skipped['sample']}: {skipped['reason']}", file=sys.stderr)
    show(result, as_json, score_lines)
    failures.end()
