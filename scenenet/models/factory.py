"""A new model from its settings."""

from __future__ import annotations

import torch

from scenenet.models.base import VoxelModel
from scenenet.models.cnn import CNN
from scenenet.models.metric_scenenet import MetricSceneNet
from scenenet.models.scenenet import SceneNet
from scenenet.models.settings import ModelSettings


def new_model(settings: ModelSettings, seed: int) -> VoxelModel:
    """An initial model with the architecture of ``settings``, drawn with ``seed``."""
    generator = torch.Generator().manual_seed(seed)
    if settings.kind == "cnn":
        return CNN(settings.n_kernels, settings.kernel_size, generator=generator)
    if settings.protocol == "operational":
        return MetricSceneNet.composed(settings.geneos, settings.first, settings.metric, generator)
    return SceneNet(settings.geneos, settings.kernel_size, generator=generator)
