"""``scenenet geneo list``."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from scenenet.cli.inputs import Failures
from scenenet.cli.options import AsJson, Kernels
from scenenet.cli.output import show

if TYPE_CHECKING:
    from scenenet.interpretability.workbench.description import KernelDescription

EXAMPLES = ("scenenet geneo list", "scenenet geneo list --kernels my_kernels/ --json")


def command(kernels: Kernels = None, as_json: AsJson = False) -> None:
    """List all kernels and what each responds to.

    With their parameters and origins.

    Provided kernels are run. The exit code is 1 if one of them fails; the others are listed.
    """
    from scenenet.interpretability.workbench.description import describe_all

    failures = Failures()
    found, failures.errors = describe_all()
    data = [asdict(kernel) for kernel in found]
    show(data, as_json, lambda _: [line for kernel in found for line in _lines(kernel)])
    failures.end()


def _lines(kernel: KernelDescription) -> list[str]:
    lines = [f"{kernel.name} ({kernel.origin}): {kernel.responds_to}"]
    lines += [f"    {_parameter(asdict(p))}" for p in kernel.parameters]
    return lines


def _parameter(p: dict[str, Any]) -> str:
    unit = "" if p["unit"] == "1" else f" {p['unit']}"
    return f"{p['name']:<8} {p['low']:g} to {p['high']:g}{unit}: {p['meaning']}"
