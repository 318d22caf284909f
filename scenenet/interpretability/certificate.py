"""The certificate of a model file: which GENEO properties it has (thesis 3.4, 4.3 to 4.5).

``scenenet.interpretability.geneo_properties`` measures the properties; this module turns them into
the content of the JSON file.
"""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path

from scenenet.interpretability.bounded_measurement import bounded
from scenenet.interpretability.composed_properties import ComposedCertificate, certify_composed
from scenenet.interpretability.equivariance import Scene, sample_scene
from scenenet.interpretability.geneo_properties import ANGLES_DEG, Certificate, certify
from scenenet.interpretability.result import ModelCertificate, Statement
from scenenet.measurement.registry import PRESENCE
from scenenet.models.geneo_model import GeneoModel
from scenenet.models.model_file import ModelCard, read_model

SCENE = "a generated pole of 15 m with an arm, two conductors, two trees and uneven ground"
"""The scene on which every model is measured, so that certificates are comparable."""

OF_CONVOLUTION = ("equivariant under translation", "equivariant under quarter turns")
"""First words of the properties that are verified for a model without GENEOs. Every convolution
has the first one. The second one needs a symmetric kernel, which such a model need not have."""


def certificate(model: str | Path) -> ModelCertificate:
    """The certificate of a tuned model file, measured in the voxels that the model observes grids
    of its training in (``VoxelModel.observed_size``).

    A model without GENEOs has the statements of ``OF_CONVOLUTION`` only.

    Raises:
        InputError: the file is not a model.
    """
    trained, card = read_model(model)
    size = trained.observed_size(card.voxel_size)
    if isinstance(trained, GeneoModel) and not trained.linear:
        return _composed(trained, card, size)
    found = certify(trained, voxel_size=size, measurement=card.measurement, tau=card.tau)
    worst = max((t.mean_h for t in found.turns if t.degrees and t.degrees % 90), default=None)
    values = (
        found.translation_error,
        found.quarter_turn_error,
        worst,
        found.l1,
        1.0,
        # For presence the property holds with any kernel, so no number supports it.
        found.measured_model if found.measurement != PRESENCE else None,
        max((k.slice_sum for k in found.kernels if k.sums_to_zero), default=None),
        found.weight_sum,
    )
    statements = tuple(
        replace(statement, value=value)
        for statement, value in zip(found.statements(), values, strict=False)
        if found.kernels or _of_convolution(statement)
    )
    return _written(found, card, size, statements)


def _composed(model: GeneoModel, card: ModelCard, size: float) -> ModelCertificate:
    """The certificate of a model that is not one kernel."""
    scene = Scene.of(sample_scene(), size, card.measurement)
    found = certify_composed(model.at(size), scene, ANGLES_DEG, card.tau, seed=0)
    return _written(found, card, size, tuple(found.statements()))


def _written(
    found: Certificate | ComposedCertificate,
    card: ModelCard,
    size: float,
    statements: tuple[Statement, ...],
) -> ModelCertificate:
    """The content of the file: ``statements``, and what ``found`` measured at voxels of ``size``
    m."""
    numbers = asdict(found)
    for name in ("kind", "half_voxel", "turns"):
        del numbers[name]
    return ModelCertificate(
        model=card.name,
        seed=card.provenance.get("seed"),
        kind=found.kind,
        voxel_size=size,
        scene=SCENE,
        half_voxel=found.half_voxel,
        turns=found.turns,
        statements=(*statements, *bounded(card.measurement, size)),
        numbers=numbers,
    )


def _of_convolution(statement: Statement) -> bool:
    return statement.property.startswith(OF_CONVOLUTION)
