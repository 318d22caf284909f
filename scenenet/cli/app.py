"""The command line: the chain for people without Snakemake.

Answers go to stdout, progress and messages to stderr. Exit code 0: done; 1: the input is at fault
and the message says how; 2: the call is.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from scenenet.core.errors import InputError

if TYPE_CHECKING:
    from scenenet.detection.settings import DetectionSettings
from scenenet.cli.options import (
    Codes,
    Fit,
    Kind,
    LabelCodes,
    Labelled,
    MinWire,
    ModelFile,
    Surveys,
    TrainedBy,
)
from scenenet.cli.output import _answer, _score_lines, _training_lines

INTERRUPTED = 130
"""Exit code after Ctrl-C, as shells have it: 128 and the number of the signal."""

BENCH_CODES = Codes("edp")
"""Class scheme of the public TS40K crops."""

app = typer.Typer(
    help="Find power-line towers in LiDAR surveys with SCENE-Net: eleven numbers with a meaning.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def _print_version(wanted: bool) -> None:
    if wanted:
        from scenenet.core.provenance import package_version

        print(f"scenenet {package_version()}")
        raise typer.Exit()


@app.callback()
def _of_every_command(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version and exit."
        ),
    ] = False,
) -> None:
    """Find power-line towers in LiDAR surveys with SCENE-Net, and explain each of them."""


AsJson = Annotated[bool, typer.Option("--json", help="Print the answer as JSON on stdout.")]


@app.command()
def check(
    surveys: Surveys,
    codes: Annotated[
        Codes | None, typer.Option(help="What the class codes mean, if they are to be named.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Say what is in surveys and what is wrong with them."""
    from scenenet.pointcloud.quality.check import check_survey

    reports, errors = [], []
    for survey in surveys:
        try:
            reports.append(check_survey(survey, None if codes is None else codes.value))
        except InputError as error:
            errors.append(error)
    if as_json:
        print(json.dumps([report.to_dict() for report in reports], indent=2))
    else:
        print("\n\n".join(report.text() for report in reports))
    for message in errors:
        print(f"error: {message}", file=sys.stderr)
    if errors:
        raise typer.Exit(1)


@app.command()
def synth(
    out: Annotated[Path, typer.Argument(help="The survey to write (.laz).")],
    towers: Annotated[int, typer.Option(min=1, help="Number of towers.")] = 10,
    seed: Annotated[int, typer.Option(min=0, help="Same seed, same survey.")] = 0,
    truth: Annotated[
        Path | None, typer.Option(help="Also write the labels before annotation noise (.laz).")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Make a synthetic corridor: a labelled survey of a power line (EDP codes)."""
    from scenenet.synthetic import SyntheticSettings, make_survey

    settings = SyntheticSettings(towers=towers, seed=seed)
    summary = make_survey(settings, out, truth=truth, progress=out.name)
    _answer(summary, as_json, lambda s: [f"{out}: {s['points']:,} points, {towers} towers"])


@app.command()
def train(
    labelled: Labelled,
    codes: LabelCodes,
    out: Annotated[
        Path, typer.Option("--out", help="Model file to write (.json; .safetensors for a cnn).")
    ],
    kind: Annotated[Kind, typer.Option(help="Architecture.")] = Kind.scenenet,
    protocol: Annotated[
        TrainedBy,
        typer.Option(
            help="operational: a SCENE-Net in metres, fitted by a search, or a CNN that starts "
            "from Fisher's discriminant; thesis: by gradient from a random start."
        ),
    ] = TrainedBy.operational,
    seeds: Annotated[int, typer.Option(min=1, help="Models to train; the best is kept.")] = 5,
    epochs: Annotated[
        int, typer.Option(min=1, help="Passes over the crops, where training is by gradient.")
    ] = 150,
    learning_rate: Annotated[
        float | None,
        typer.Option(
            min=1e-6,
            help="Step size of RMSProp, where training is by gradient; 0.01 if not given, and "
            "0.001 for a CNN of protocol operational, which larger steps lead away from its start.",
        ),
    ] = None,
    resolution: Annotated[
        int, typer.Option(help="Voxels an edge of a crop: 32, 64, 128, 256.")
    ] = 64,
    validation: Annotated[
        float | None,
        typer.Option(
            min=0,
            max=0.9,
            help="Share of the crops kept to tune on; 0.3 if not given, and none for a SCENE-Net "
            "of protocol operational, whose eleven numbers hardly know their crops by heart.",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Train a model on labelled crops or surveys."""
    from scenenet.cli.labelled_files import train_files
    from scenenet.core.files import digest
    from scenenet.core.provenance import package_version
    from scenenet.models.settings import ModelSettings, TrainingSettings, TuningSettings

    ending = ".json" if kind is Kind.scenenet else ".safetensors"
    if out.suffix != ending:
        raise typer.BadParameter(f"a {kind} is kept in a {ending} file", param_hint="--out")
    in_metres = kind is Kind.scenenet and protocol is TrainedBy.operational
    if validation is None:
        validation = 0.0 if in_metres else 0.3
    if learning_rate is None:
        learning_rate = 0.001 if protocol is TrainedBy.operational else 0.01
    init = "informed" if protocol is TrainedBy.operational else "thesis"
    training = TrainingSettings(init=init, epochs=epochs, learning_rate=learning_rate)
    settings = ModelSettings(
        name=kind.value, kind=kind.value, protocol=protocol.value, training=training
    )
    result = train_files(
        labelled,
        codes.value,
        _cube(resolution),
        settings,
        TuningSettings(kernel_sizes=((9, 7, 7), (9, 5, 5), (13, 7, 7))),
        range(seeds),
        validation,
        {
            "config": digest(settings.model_dump()),
            "version": package_version(),
            "files": [path.name for path in labelled],
        },
        out,
    )
    _answer(result, as_json, _training_lines)


@app.command()
def predict(
    surveys: Surveys,
    model: ModelFile,
    out: Annotated[Path, typer.Option("--out", help="Folder for the results.")],
    voxel_size: Annotated[
        float | None,
        typer.Option(min=0.01, help="Edge of a voxel in m; as the model was trained if not given."),
    ] = None,
    min_wire: MinWire = None,
    as_json: AsJson = False,
) -> None:
    """Classify surveys: DIR/NAME.laz, NAME.towers.geojson and NAME.summary.json for each."""
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
        summaries.append(
            predict_to_files(
                survey,
                model,
                target,
                target.with_suffix(".towers.geojson"),
                target.with_suffix(".summary.json"),
                settings,
                _detection(min_wire),
            ).to_json()
        )
    _answer(
        summaries,
        as_json,
        lambda all_: [
            f"{s['survey']}: {s['towers']} towers among {s['points']:,} points" for s in all_
        ],
    )


@app.command()
def evaluate(
    labelled: Labelled,
    model: ModelFile,
    codes: LabelCodes,
    fit: Annotated[
        Fit,
        typer.Option(
            help="cube: a grid over the bounding cube of each crop, as the thesis; "
            "metric: the model's own voxel size, and towers looked for in whole surveys."
        ),
    ] = Fit.cube,
    resolution: Annotated[
        int, typer.Option(help="Voxels an edge for --fit cube: 32, 64, 128, 256.")
    ] = 64,
    min_wire: MinWire = None,
    as_json: AsJson = False,
) -> None:
    """Score a model on labelled crops or surveys: voxels and towers."""
    from scenenet.cli.labelled_files import evaluate_files

    grid = _cube(resolution) if fit is Fit.cube else None
    result = evaluate_files(labelled, model, codes.value, grid, _detection(min_wire))
    for skipped in result["skipped"]:
        print(f"not scored: {skipped['sample']}: {skipped['reason']}", file=sys.stderr)
    _answer(result, as_json, _score_lines)


@app.command()
def explain(
    survey: Annotated[Path, typer.Argument(help="LAS, LAZ or COPC survey, or a TS40K sample.")],
    model: ModelFile,
    out: Annotated[Path, typer.Option("--out", help="Page to write (.html).")],
    min_wire: MinWire = None,
    as_json: AsJson = False,
) -> None:
    """Write a page that says for every tower why it is one."""
    from dataclasses import asdict

    from scenenet.core.extras import require
    from scenenet.prediction.settings import PredictSettings

    require("report", "scenenet explain")  # before the survey is predicted, which takes minutes
    from scenenet.report.explanation_page import explain_survey

    found = explain_survey(survey, model, out, PredictSettings(), _detection(min_wire))
    _answer(
        [asdict(receipt) for receipt in found],
        as_json,
        lambda all_: [f"{out}: the reasons for {len(all_)} towers"],
    )


@app.command()
def bench(
    crops: Annotated[
        Path | None, typer.Option(help="Folder of TS40K samples; synthetic crops if not given.")
    ] = None,
    codes: LabelCodes = BENCH_CODES,
    quick: Annotated[
        bool, typer.Option("--quick", help="The convolution alone; under a minute.")
    ] = False,
    thesis: Annotated[
        bool, typer.Option("--thesis", help="Also train on 565 synthetic crops for 50 epochs.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Measure the speed of the engine beside other ways to the same results (some minutes)."""
    from scenenet.bench import BenchSettings, tables
    from scenenet.bench import bench as run

    settings = BenchSettings(crops=crops, codes=codes.value, quick=quick, thesis=thesis)
    _answer(run(settings), as_json, tables)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line; errors of the input end with their message and code 1."""
    try:
        app(arguments)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(1)
    except SystemExit as end:
        if end.code == INTERRUPTED:  # typer ends so on Ctrl-C, without a word
            print("interrupted; nothing was left half-written", file=sys.stderr)
        raise


def _cube(resolution: int) -> Any:
    from scenenet.dataset.voxels import VoxelSettings

    if resolution not in (32, 64, 128, 256):
        raise typer.BadParameter("must be 32, 64, 128 or 256", param_hint="--resolution")
    return VoxelSettings(fit="cube", resolution=resolution)


def _detection(min_wire: float | None) -> DetectionSettings:
    from scenenet.detection.settings import DetectionSettings

    return DetectionSettings() if min_wire is None else DetectionSettings(min_wire=min_wire)
