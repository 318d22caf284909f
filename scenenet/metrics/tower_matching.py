"""Predicted towers matched with labelled towers by position."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenenet.metrics.voxel_scores import Confusion


@dataclass(frozen=True)
class TowerMatch:
    """The outcome of matching predicted towers with labelled towers.

    Attributes:
        errors: (hits,) m, planar distance of each hit from its labelled tower.
        n_true, n_predicted: numbers of labelled and of predicted towers.
    """

    errors: np.ndarray
    n_true: int
    n_predicted: int

    def __add__(self, other: TowerMatch) -> TowerMatch:
        return TowerMatch(
            np.concatenate([self.errors, other.errors]),
            self.n_true + other.n_true,
            self.n_predicted + other.n_predicted,
        )

    def scores(self) -> dict[str, float | int | None]:
        """The numbers of ``scenenet.metrics.score_columns.MATCH_COLUMNS`` by their names.

        Precision and recall are defined as for voxels: without labelled towers there is no recall,
        and without labelled and predicted towers no precision.
        """
        hits = len(self.errors)
        counts = Confusion(hits, self.n_predicted - hits, self.n_true - hits)
        return {
            "precision": counts.precision,
            "recall": counts.recall,
            "median_error_m": float(np.median(self.errors)) if hits else None,
            "n_true": self.n_true,
            "n_predicted": self.n_predicted,
        }


HIT_DISTANCE_M = 5.0
"""A predicted tower within this planar distance of a labelled tower is a hit."""


def match_towers(
    predicted: np.ndarray, true: np.ndarray, distance: float = HIT_DISTANCE_M
) -> TowerMatch:
    """Pair predicted with labelled towers, nearest pairs first; each tower is used at most once.

    Args:
        predicted: (P, 2) m, x and y.
        true: (T, 2) m, x and y.
        distance: m, largest planar distance of a pair.
    """
    predicted = np.asarray(predicted, float).reshape(-1, 2)
    true = np.asarray(true, float).reshape(-1, 2)
    apart = np.linalg.norm(predicted[:, None] - true[None], axis=2)
    taken_predicted, taken_true, errors = set(), set(), []
    for flat in np.argsort(apart, axis=None, kind="stable"):
        i, j = (int(k) for k in np.unravel_index(flat, apart.shape))
        if apart[i, j] > distance:
            break
        if i in taken_predicted or j in taken_true:
            continue
        taken_predicted.add(i)
        taken_true.add(j)
        errors.append(apart[i, j])
    return TowerMatch(np.asarray(errors, float), len(true), len(predicted))
