"""Predicted towers matched with labelled towers by position."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from scenenet.metrics.voxel_scores import Confusion


@dataclass(frozen=True)
class TowerMatch:
    """The outcome of matching predicted towers with labelled towers.

    Attributes:
        errors: (hits,) m, planar distance of each hit from its labelled tower.
        n_true, n_predicted: numbers of labelled and of predicted towers.
        base_errors, height_errors: m, absolute errors of the hits whose labelled tower has a known
            elevation of the ground, and height above it.
    """

    errors: np.ndarray
    n_true: int
    n_predicted: int
    base_errors: np.ndarray = field(default_factory=lambda: np.empty(0))
    height_errors: np.ndarray = field(default_factory=lambda: np.empty(0))

    @classmethod
    def none(cls) -> TowerMatch:
        """The sum of no matches."""
        return cls(np.empty(0), 0, 0)

    def __add__(self, other: TowerMatch) -> TowerMatch:
        return TowerMatch(
            np.concatenate([self.errors, other.errors]),
            self.n_true + other.n_true,
            self.n_predicted + other.n_predicted,
            np.concatenate([self.base_errors, other.base_errors]),
            np.concatenate([self.height_errors, other.height_errors]),
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
            "median_error_m": _median(self.errors),
            "median_height_error_m": _median(self.height_errors),
            "median_base_error_m": _median(self.base_errors),
            "n_true": self.n_true,
            "n_predicted": self.n_predicted,
        }


def _median(errors: np.ndarray) -> float | None:
    return float(np.median(errors)) if len(errors) else None


HIT_DISTANCE_M = 5.0
"""A predicted tower within this planar distance of a labelled tower is a hit."""


def match_towers(
    predicted: np.ndarray, true: np.ndarray, distance: float = HIT_DISTANCE_M
) -> TowerMatch:
    """Pair predicted with labelled towers, nearest pairs first; each tower is used at most once.

    Args:
        predicted: (P, 2) or (P, 4) m, x and y, and the elevation of the base and the height.
        true: (T, 2) or (T, 4) m, the same; NaN where it is not known.
        distance: m, largest planar distance of a pair.
    """
    predicted, true = _with_heights(predicted), _with_heights(true)
    apart = np.linalg.norm(predicted[:, None, :2] - true[None, :, :2], axis=2)
    taken_predicted, taken_true, errors, off = set(), set(), [], [np.empty((0, 2))]
    for flat in np.argsort(apart, axis=None, kind="stable"):
        i, j = (int(k) for k in np.unravel_index(flat, apart.shape))
        if apart[i, j] > distance:
            break
        if i in taken_predicted or j in taken_true:
            continue
        taken_predicted.add(i)
        taken_true.add(j)
        errors.append(apart[i, j])
        off.append(np.abs(predicted[i : i + 1, 2:] - true[j : j + 1, 2:]))
    base, height = (column[~np.isnan(column)] for column in np.concatenate(off).T)
    return TowerMatch(np.asarray(errors, float), len(true), len(predicted), base, height)


def _with_heights(towers: np.ndarray) -> np.ndarray:
    """(N, 4) m: x, y, base and height; the last two are NaN if only x and y are given."""
    towers = np.asarray(towers, float)
    if towers.ndim == 2 and towers.shape[1] == 4:
        return towers
    places = towers.reshape(-1, 2)
    return np.column_stack([places, np.full((len(places), 2), np.nan)])
