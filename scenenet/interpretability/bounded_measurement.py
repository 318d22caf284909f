"""Whether a measurement phi lies in [0, 1], as the other properties of a model take for granted."""

from __future__ import annotations

import numpy as np

from scenenet.core.errors import InputError
from scenenet.interpretability.equivariance import Scene, sample_scene
from scenenet.interpretability.result import Statement
from scenenet.measurement.outside import tried_voxels
from scenenet.measurement.registry import PRESENCE, measurement_named


def bounded(measurement: str, voxel_size: float) -> tuple[Statement, ...]:
    """The statement that phi lies in [0, 1]; none for presence, which is 1.

    It is measured on voxels whose fields lie in the whole range that files allow, and on the scene
    of the certificate. A value beyond stops a training or a prediction as well.

    Args:
        voxel_size: m, of the voxels of the scene.
    """
    if measurement == PRESENCE:
        return ()
    measure = measurement_named(measurement)
    try:
        scene = Scene.of(sample_scene(), voxel_size, measurement)
        seen = scene.voxelised(scene.xyz)[0].values
        phi = np.concatenate(
            [measure.phi(tried_voxels(measure)), np.empty(0) if seen is None else seen]
        )
    except InputError as error:
        return (Statement("the measurement lies in [0, 1]", "4.2.2", False, error.problem),)
    low, high = float(phi.min()), float(phi.max())
    text = f"{measurement} was {low:.3g} to {high:.3g} in {len(phi)} voxels"
    return (Statement("the measurement lies in [0, 1]", "4.2.2", True, text, high),)
