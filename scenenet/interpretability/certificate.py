"""The certificate of a model file: which promises of a GENEO it keeps (thesis 3.4, 4.3 to 4.5).

``scenenet.interpretability.geneo_properties`` works it out; here it is brought to what stands in a
result folder.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from scenenet.interpretability.geneo_properties import Statement, certify
from scenenet.models.model_file import read_model

SCENE = "a pole of 15 m with an arm, two wires, two trees and bumpy ground, made by rule"
"""What every model is measured on, so that two certificates can be compared."""

OF_CONVOLUTION = ("equivariant under translation", "equivariant under quarter turns")
"""Beginnings of the properties that are asked of a model without GENEOs: the first it has because
it is a convolution, the second it would need a kernel for that nothing makes it have."""


def certificate(model: str | Path) -> dict[str, Any]:
    """All numbers of a model's certificate, and its statements.

    Args:
        model: a tuned model file; it is measured at the voxel size of its card.

    Returns:
        model, seed, kind, voxel_size (m), scene, the numbers of
        ``scenenet.interpretability.geneo_properties.Certificate``, and ``statements``: property,
        thesis, holds,
        text and value, a number that goes with the property. Of a model without GENEOs only those
        of ``OF_CONVOLUTION``.
    """
    trained, card = read_model(model)
    found = certify(trained, voxel_size=card.voxel_size, measurement=card.measurement, tau=card.tau)
    worst = max((t.mean_h for t in found.turns if t.degrees and t.degrees % 90), default=None)
    values = (
        found.translation_error,
        found.quarter_turn_error,
        worst,
        found.l1,
        1.0,
        # Between presences the property holds for any kernel, and no number goes with it.
        found.measured_model if found.measurement == "density" else None,
        max((k.slice_sum for k in found.kernels if k.sums_to_zero), default=None),
        found.weight_sum,
    )
    statements = [
        {**vars(statement), "value": value}
        for statement, value in zip(found.statements(), values, strict=False)
        if found.kernels or _asked_of_any(statement)
    ]
    return {
        "model": card.name,
        "seed": card.provenance.get("seed"),
        "voxel_size": card.voxel_size,
        "scene": SCENE,
        **found.as_dict(),
        "statements": statements,
    }


def _asked_of_any(statement: Statement) -> bool:
    return statement.property.startswith(OF_CONVOLUTION)
