"""Fixed folds of crops, so that every crop is left out once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scenenet.core.errors import InputError
from scenenet.dataset.crops import Crop


@dataclass(frozen=True)
class Fold:
    """Positions of crops in the list the fold was made from.

    Attributes:
        out: left out, and scored.
        learnt: trained on.
        beside: neighbours of those left out, in no part.
    """

    out: list[int]
    learnt: list[int]
    beside: list[int]


def folds(crops: Sequence[Crop], leave_out: int, neighbour: float) -> list[Fold]:
    """Leave ``leave_out`` crops out at a time, in the order of their ids; the last fold may have
    fewer.

    A crop that shares ground with one left out, or is nearer to it than ``neighbour`` (m, between
    towers), sees the same surroundings, so it is not trained on either.

    Raises:
        InputError: there are not two crops to train on in every fold.
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
        learnt = [i for i in others if not near[i]]
        if len(learnt) < 2:
            names = ", ".join(crops[i].id for i in out)
            raise InputError(
                f"with {names} left out, {len(learnt)} of {len(crops)} crops can be trained on; "
                f"{len(others) - len(learnt)} are their neighbours",
                remedy="Add crops, or set cross_validation.leave_out or split.neighbour lower",
            )
        made.append(Fold(out, learnt, [i for i in others if near[i]]))
    return made
