"""``scenenet geneo try``."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from scenenet.cli.commands.geneo.options import (
    ABOVE,
    BELOW,
    RADIUS,
    Above,
    Below,
    Name,
    Radius,
    Values,
    VoxelSize,
    sampled,
)
from scenenet.cli.options import AsJson, Codes, Kernels, Overwrite
from scenenet.cli.output import show
from scenenet.interpretability.workbench.window import WHOLE, WINDOW_M, Window
from scenenet.pointcloud.class_schemes import difference

if TYPE_CHECKING:
    from scenenet.interpretability.workbench.trial import Trial

EXAMPLES = (
    "scenenet geneo try cylinder line.laz --codes edp",
    "scenenet geneo try lamp town.laz --kernels lamp.py --set r=0.2 --out lamp.html",
)


def command(
    name: Name,
    survey: Annotated[
        Path, typer.Argument(help="LAS, LAZ or COPC survey in metres, or TS40K sample.")
    ],
    codes: Annotated[
        Codes | None,
        typer.Option("--codes", help=f"Class scheme, for the names of classes ({difference()})."),
    ] = None,
    values: Values = None,
    voxel_size: VoxelSize = 1.0,
    radius: Radius = RADIUS,
    above: Above = ABOVE,
    below: Below = BELOW,
    out: Annotated[
        Path | None, typer.Option("--out", help="Page with pictures to write (.html).")
    ] = None,
    at: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y",
            help="Middle of a square of the survey, in its coordinates; only the square is tried. "
            f"Without it a survey of more than {WHOLE:,} points is tried about the point in the "
            "middle of the file.",
        ),
    ] = None,
    window: Annotated[
        float, typer.Option(min=1, max=1e4, help="Edge of this square in m.")
    ] = WINDOW_M,
    kernels: Kernels = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Measure what a kernel responds to in a survey.

    Its response to each class, and where it is highest.

    The response is that of the kernel alone at each occupied voxel, before any training. A large
    survey is tried on a square (--at, --window), which the output names.

    The equivariance is measured on a generated scene, the same for every kernel. A page that exists
    is replaced only if this command wrote it.
    """
    from scenenet.core.extras import require
    from scenenet.core.outputs import Output, check_outputs
    from scenenet.interpretability.workbench.trial import try_kernel

    if out is not None:
        if out.suffix.lower() not in (".html", ".htm"):
            raise typer.BadParameter("the page is an .html file", param_hint="--out")
        require("report", "scenenet geneo try --out")
        from scenenet.report.trial_page import is_trial

        check_outputs([Output(out, is_trial)], [survey], overwrite=overwrite)
    chosen = sampled(name, values, voxel_size, radius, above, below)
    square = None if at is None else Window(*_place(at), window)
    trial = try_kernel(chosen, survey, None if codes is None else codes.value, square, window)
    if out is not None:
        from scenenet.report.trial_page import write_trial_page

        write_trial_page(trial, out)
    show(_plain(trial), as_json, lambda _: _lines(trial, out))


def _place(text: str) -> tuple[float, float]:
    """x and y of ``--at``.

    Raises:
        typer.BadParameter: it is not a pair of numbers.
    """
    try:
        x, y = map(float, text.split(","))
    except ValueError:
        raise typer.BadParameter("give two numbers: 530100,4630200", param_hint="--at") from None
    return x, y


def _plain(trial: Trial) -> dict[str, Any]:
    """A trial without its points."""
    arrays = ("xyz", "codes", "responses")
    return {name: value for name, value in asdict(trial).items() if name not in arrays}


def _square(trial: Trial) -> list[str]:
    if (w := trial.window) is None:
        return []
    return [f"only the square of {w.edge:g} m about ({w.x:.2f}, {w.y:.2f})"]


def _lines(trial: Trial, out: Path | None) -> list[str]:
    values = ", ".join(
        f"{p.name} = {p.value:.3g}{'' if p.unit == '1' else f' {p.unit}'}" for p in trial.parameters
    )
    e = trial.equivariance
    lines = [
        f"{trial.kernel} ({values or 'no parameters'}) on {trial.survey}: {trial.points:,} points "
        f"in {trial.voxels:,} voxels of {trial.voxel_size:g} m",
        *_square(trial),
        f"equivariance error: shifts {e.translation:.1e}, quarter turns {e.quarter_turn:.1e} of "
        f"the largest response; {e.between_degrees:g} degrees {e.between:.2f} of its spread "
        f"(half a voxel: {e.half_voxel:.2f})",
        "",
        f"{'class':<34}{'points':>10}{'mean':>10}{'positive':>10}{'highest':>10}",
    ]
    for c in trial.classes:
        lines.append(
            f"{f'{c.code} {c.name}'.strip():<34}{c.points:>10,}{c.mean:>10.3f}{c.positive:>10.1%}"
            f"{c.highest:>10.3f}"
        )
    lines += ["", f"{'highest responses':<17}{'x':>14}{'y':>14}{'z':>10}{'response':>10}  class"]
    for number, p in enumerate(trial.places, start=1):
        lines.append(
            f"{number:<17}{p.x:>14.2f}{p.y:>14.2f}{p.z:>10.2f}{p.response:>10.3f}  "
            f"{p.code} {p.name}"
        )
    if not trial.places:
        lines.append("no response is positive")
    return lines if out is None else [*lines, "", f"{out}: the page"]
