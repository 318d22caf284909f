"""``scenenet geneo show``."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

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
from scenenet.cli.options import AsJson, Kernels, Overwrite
from scenenet.cli.output import show

if TYPE_CHECKING:
    from scenenet.interpretability.workbench.description import (
        KernelDescription,
        KernelFacts,
        ParameterDescription,
    )

EXAMPLES = (
    "scenenet geneo show cylinder",
    "scenenet geneo show lamp --kernels lamp.py --set r=0.3 --out lamp.png",
)


def command(
    name: Name,
    values: Values = None,
    voxel_size: VoxelSize = 1.0,
    radius: Radius = RADIUS,
    above: Above = ABOVE,
    below: Below = BELOW,
    out: Annotated[
        Path | None, typer.Option("--out", help="Picture of the kernel to write (.png).")
    ] = None,
    kernels: Kernels = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Show the formula and the values of a kernel.

    With its parameters in words, and what is true of it.

    The slices show the values in ninths of the largest one; zero is a dot. A kernel with a
    direction is shown along x.

    A file that exists is replaced only with --overwrite.
    """
    from scenenet.core.outputs import Output, check_outputs
    from scenenet.interpretability.workbench.description import (
        KernelFacts,
        describe,
        parameters_of,
        side_view,
        top_view,
    )

    if out is not None:
        from scenenet.core.extras import require

        if out.suffix.lower() != ".png":
            raise typer.BadParameter("a picture is a .png file", param_hint="--out")
        require("report", "a picture of a kernel")
        check_outputs([Output(out, lambda _: False)], [], overwrite=overwrite)
    described = describe(name)
    chosen = sampled(name, values, voxel_size, radius, above, below)
    kernel = chosen.sampled()
    parameters, facts = parameters_of(chosen), KernelFacts.of(chosen.orbit, voxel_size)
    side, (row, top) = side_view(kernel.numpy()), top_view(kernel.numpy())
    height = (row - (kernel.shape[0] - 1) // 2) * voxel_size
    if out is not None:
        from scenenet.figures.plots.parameters import kernels as draw

        draw({name: kernel.numpy()}, out, metres=voxel_size)
    data = asdict(described) | {
        "parameters": [asdict(parameter) for parameter in parameters],
        "facts": asdict(facts),
        "values": kernel.tolist(),
    }
    key = "9 is the largest value and . is 0; + and - are less than a ninth of it"
    slices = ["from the side, up is up:", *side, "", f"from above, at z = {height:g} m:", *top]
    slices += ["", key]
    show(
        data,
        as_json,
        lambda _: [*_head(described, parameters), "", *_facts(facts, described), "", *slices],
    )


def _head(kernel: KernelDescription, parameters: tuple[ParameterDescription, ...]) -> list[str]:
    lines = [f"{kernel.name} ({kernel.origin}): {kernel.responds_to}", "", kernel.formula]
    if parameters:
        lines.append("")
    for p in parameters:
        unit = "" if p.unit == "1" else f" {p.unit}"
        lines += [
            f"{p.name} = {p.value:.3g}{unit}, of {p.low:g} to {p.high:g}: {p.meaning}",
            f"    {p.sentence}",
        ]
    return lines


def _facts(facts: KernelFacts, kernel: KernelDescription) -> list[str]:
    size = "x".join(map(str, facts.size))
    zero = "yes" if facts.sums_to_zero else f"no, up to {facts.slice_sum:.3g}"
    turn, what = facts.quarter_turn_error, "the orbit" if facts.directions > 1 else "it"
    orbit = ["the orbit, whose largest response counts: " + _directions(kernel)]
    return [
        *(orbit if facts.directions > 1 else []),
        f"{size} voxels of {facts.voxel_size:g} m, from {facts.lowest:.3g} to {facts.highest:.3g}",
        f"every slice sums to zero: {zero}; total {facts.total:.3g}",
        f"constant of non-expansivity, the sum of |g|: {facts.l1:.3g}",
        f"quarter turns about z leave {what} unchanged: "
        + ("yes" if turn <= 1e-4 else f"no, it changes by {turn:.0%} of its largest value"),
    ]


def _directions(kernel: KernelDescription) -> str:
    slopes = "" if len(kernel.slopes) == 1 else f", at {len(kernel.slopes)} slopes each"
    return f"{kernel.turns} turns about z{slopes}"
