"""Folds for cross-validation: every crop is left out once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scenenet.core.errors import InputError
from scenenet.dataset.crops import Crop


@dataclass(frozen=True)
class Fold:
    """One fold: positions of crops in the list that it was made from.

    Attributes:
        out: crops that are left out of training and scored.
        train: crops to train on.
        excluded: neighbours of the crops left out; neither trained on nor scored.
    """

    out: list[int]
    train: list[int]
    excluded: list[int]


def folds(crops: Sequence[Crop], leave_out: int, neighbour: float) -> list[Fold]:
    """Leave out ``leave_out`` crops at a time, in the order of their ids; the last fold may have
    fewer.

    A crop that overlaps one left out, or whose tower is nearer to its tower than ``neighbour`` (m),
    shows the same surroundings, so it is excluded from training.

    Raises:
        InputError: a fold has fewer than two crops to train on.
    """
    order = sorted(range(len(crops)), key=lambda i: crops[i].id)
    xy = np.array([(crop.x, crop.y) for crop in crops], float).reshape(-1, 2)
    radius = np.array([crop.radius for crop in crops], float)
    made = []
    for first in range(0, len(order), leave_out):
        out = order[first : first + leave_out]
        apart = np.linalg.norm(xy[:, None] - xy[None, out], axis=2)
        near = (apart < np.maximum(neighbour, radius[:, None] + radius[None, out])).any(axis=1)
        others = [i for i in order if i not in out]
        train = [i for i in others if not near[i]]
        if len(train) < 2:
            names = ", ".join(crops[i].id for i in out)
            raise InputError(
                f"with {names} left out, only {len(train)} of {len(crops)} crops remain for "
                "training; "
                f"{len(others) - len(train)} are excluded as neighbours",
                remedy="Add crops, or set cross_validation.leave_out or split.neighbour lower",
            )
        made.append(Fold(out, train, [i for i in others if near[i]]))
    return made
