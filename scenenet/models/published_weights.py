"""The parameters that were published with the code of the thesis, as a SCENE-Net.

They belong to kernels of 9x5x5 voxels. The published code differs from the thesis in places
(docs/development/architecture.md); here the numbers stand in the kernels of the thesis.
"""

from __future__ import annotations

from scenenet.models.scenenet import SceneNet
from scenenet.models.settings import KernelSize

KERNEL_SIZE: KernelSize = (9, 5, 5)
"""(kz, ky, kx), voxels."""

WEIGHTS = {
    "cylinder.r": 0.999,
    "cylinder.sigma": 1.199,
    "arrow.r": 1.5,
    "arrow.sigma": 0.956,
    "arrow.r_c": 4.0,
    "arrow.beta": 0.566,
    "negative_sphere.r": 3.0,
    "negative_sphere.sigma": 0.605,
    "negative_sphere.omega": 0.127,
    "lambda.cylinder": 0.024,
    "lambda.arrow": 0.609,
    "lambda.negative_sphere": 0.367,
}
"""Every published number: lengths in voxels, sigma in squared voxels."""


def published_scenenet() -> SceneNet:
    """A SCENE-Net of kernels in voxels with the published parameters."""
    model = SceneNet(kernel_size=KERNEL_SIZE)
    model.set_shape_parameters(WEIGHTS)
    return model
