"""Settings of a model that is trained without a configuration, as ``scenenet train`` does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from scenenet.measurement.registry import PRESENCE
from scenenet.models.settings import (
    Mixing,
    ModelSettings,
    TrainingSettings,
    TuningSettings,
)
from scenenet.pointcloud.targets import TOWER, Target

EPOCHS = 150
"""Passes over the crops for training by gradient."""

LEARNING_RATES: dict[str, float] = {"thesis": 0.01, "operational": 0.001}
"""Step size of RMSProp. The CNN of the operational protocol starts near its optimum, from Fisher's
discriminant; larger steps lead away from it."""

VALIDATION_SHARE = 0.3
"""Share of the crops that is kept to choose tau and the kernel size on."""

OF_INTERSECTION = 0.25
"""False weight with which the weighted F0.5 orders models as their intersection over union does:
missed and false voxels count alike."""

ELSEWHERE = 2.0
"""How much more a false voxel counts than on the training crops, which have little besides a tower:
the default of ``MetricSettings.false_weight``."""

TUNING = TuningSettings(kernel_sizes=((9, 7, 7), (9, 5, 5), (13, 7, 7)))
"""Kernel sizes that the crops of the thesis favour, besides that of the training."""


OBSERVERS: Mapping[str, Mapping[str, Any]] = {
    "wire": {
        "geneos": ("line",),
        "first": ("identity", "canopy", "ground"),
        "metric": {
            "observed": 0.5,
            "false_weight": ELSEWHERE * OF_INTERSECTION,
            "whole_towers": False,
            # The strongest response within a metre: insulators and jumpers are not straight lines.
            "section_radius": 1.0,
            "section_above": 0.0,
        },
        "search": {"result": "middle", "starts": 256},
    },
    "vegetation": {
        "geneos": ("blob", "plane"),
        "metric": {
            "false_weight": ELSEWHERE * OF_INTERSECTION,
            "whole_towers": False,
            "section_radius": 0.0,
            "section_above": 0.0,
        },
    },
}
"""Settings of the observers of targets other than towers (docs/method/observers.md), by the name of
the target; others take the kernels of the thesis."""

VOXEL_SIZES: Mapping[str, float] = {"wire": 0.5, "vegetation": 1.0}
"""m, voxel size of the training of these observers, where none is given."""


def is_searched(kind: str, protocol: str) -> bool:
    """Whether the model is fitted by a search: it then has no epochs and no learning rate."""
    return kind == "scenenet" and protocol == "operational"


def preset(
    kind: str,
    protocol: str,
    epochs: int | None = None,
    learning_rate: float | None = None,
    geneos: Sequence[str] | None = None,
    target: Target = TOWER,
    measurement: str = PRESENCE,
    mixing: Mixing = "convex",
) -> ModelSettings:
    """The settings of a model of ``kind`` trained by ``protocol``.

    Args:
        epochs, learning_rate: of training by gradient; None for ``EPOCHS`` and ``LEARNING_RATES``.
        geneos: kernels of a SCENE-Net; None for those of ``OBSERVERS``, or of the thesis.
        target: what the model finds; only a model of towers gives whole towers.
        measurement: phi of its input.
        mixing: how the kernels of a SCENE-Net in metres become one observer.

    Raises:
        ValueError: epochs or rate are given for a model that is fitted by a search, ``mixing`` for
            one that is not, a kernel is
            or a measurement is unknown, or the model has no kernels to choose.
    """
    chosen: dict[str, Any] = {} if geneos is None else {"geneos": tuple(geneos)}
    chosen |= {"target": target.text, "measurement": measurement}
    if is_searched(kind, protocol) and not target.is_tower:
        if geneos is None and target.name in OBSERVERS:
            chosen |= OBSERVERS[target.name]
        else:
            chosen["metric"] = {"whole_towers": False}
    if mixing != "convex":
        if not is_searched(kind, protocol):
            raise ValueError("only a SCENE-Net in metres has a maximum or a product of kernels")
        chosen["metric"] = {**chosen.get("metric", {}), "mixing": mixing}
    if is_searched(kind, protocol):
        if epochs is not None or learning_rate is not None:
            raise ValueError("a search has no epochs and no learning rate")
        return ModelSettings(name=kind, kind=kind, protocol=protocol, **chosen)
    training = TrainingSettings(
        init="informed" if protocol == "operational" else "thesis",
        epochs=epochs or EPOCHS,
        learning_rate=learning_rate or LEARNING_RATES[protocol],
    )
    if kind == "cnn":  # the protocol of a CNN is its training
        return ModelSettings(name=kind, kind=kind, training=training, **chosen)
    return ModelSettings(name=kind, kind=kind, protocol=protocol, training=training, **chosen)


def voxel_size(kind: str, protocol: str, target: Target) -> float | None:
    """m, voxel size of the training where none is given; None for that of a 64^3 grid."""
    return VOXEL_SIZES.get(target.name) if is_searched(kind, protocol) else None


def validation_share(kind: str, protocol: str) -> float:
    """Share of the crops that is kept for tuning.

    It is 0 for a model that is fitted by a search: with eleven parameters it hardly overfits its
    crops, and learns from all of them.
    """
    return 0.0 if is_searched(kind, protocol) else VALIDATION_SHARE
