"""``scenenet geneo certify``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scenenet.cli.options import AsJson, Kernels, Measurements, ModelFile
from scenenet.cli.output import show

if TYPE_CHECKING:
    from scenenet.interpretability.result import ModelCertificate

EXAMPLES = ("scenenet geneo certify --model model.json",)


def command(
    model: ModelFile,
    kernels: Kernels = None,
    measurements: Measurements = None,
    as_json: AsJson = False,
) -> None:
    """Verify which GENEO properties a model has.

    Some are calculated, the others measured.

    The exit code is 0 whether the properties hold or not.
    """
    from scenenet.interpretability.certificate import certificate

    found = certificate(model)
    show(found.to_json(), as_json, lambda _: _lines(found))


def _lines(found: ModelCertificate) -> list[str]:
    seed = "" if found.seed is None else f", seed {found.seed}"
    lines = [f"{found.model} ({found.kind}{seed}), in voxels of {found.voxel_size:g} m"]
    for statement in found.statements:
        holds = "yes" if statement.holds else "NO "
        lines += [
            f"{holds}  {statement.property} (thesis {statement.thesis})",
            f"     {statement.text}",
        ]
    return [*lines, f"measured on {found.scene}"]
