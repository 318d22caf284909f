"""Which points a review makes points of a tower, and which it does not."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scenenet.core.errors import InputError
from scenenet.dataset.labelled_towers import TowerSettings, cluster
from scenenet.detection.measured_tower import MeasuredTower
from scenenet.metrics.tower_matching import HIT_DISTANCE_M
from scenenet.pointcloud.class_schemes import ClassScheme
from scenenet.review.labels.points import Points
from scenenet.review.merge import Review
from scenenet.review.reviewed_tower import ReviewedTower

OTHER = "Unclassified"
"""Class of a point that was labelled tower and is none."""


@dataclass(frozen=True)
class Codes:
    """Class codes of a scheme.

    Attributes:
        tower: of a point of a tower.
        towers: all codes of towers.
        other: of a point that is known to be of no tower, and nothing else.
    """

    tower: int
    towers: tuple[int, ...]
    other: int

    @classmethod
    def of(cls, scheme: ClassScheme) -> Codes:
        """The codes of a scheme.

        Raises:
            InputError: it has none for a point of no class.
        """
        try:
            other = scheme.code_of(OTHER)
        except KeyError:
            raise InputError(
                f"class scheme {scheme.name} has no class {OTHER!r}, which the points of rejected "
                "towers would get",
                remedy="Name the scheme edp or asprs with --codes",
            ) from None
        return cls(scheme.main_code("tower"), tuple(sorted(scheme.tower)), other)


class Relabelling:
    """The labels of a survey after a review.

    - The own points of an accepted tower are labelled tower.
    - So are the points in the structure of an added tower that no other tower has.
    - No own point of a rejected tower is labelled tower. Labels around it, which annotators wrote,
      end as well: of the group of labelled points at its place, those that no tower that was kept
      is nearer to.
    - All other points keep their classes, those of towers without a decision too.
    """

    def __init__(
        self,
        review: Review,
        added: Mapping[int, MeasuredTower],
        codes: Codes,
        *,
        accept_rest: bool = False,
    ) -> None:
        """Nothing is relabelled yet.

        Args:
            added: structures of towers that were added, by id.
            accept_rest: whether towers without a decision are labelled as accepted ones.
        """
        self.codes = codes
        taken = ("accepted", "not reviewed") if accept_rest else ("accepted",)
        self._accepted = _ids(t for t in review.towers if t.decision in taken)
        self._rejected = _ids(review.decided("rejected"))
        self._kept = _ids(review.kept)
        self._added = dict(added)
        self._rejected_at = _places(review.decided("rejected"))
        self._kept_at = _places(review.kept)

    def cleared(self, labelled: np.ndarray) -> np.ndarray:
        """Which points labelled tower stand at the place of a rejected tower.

        Args:
            labelled: (N, 3) m, all points of a file that are labelled tower.

        Returns:
            (N,) bool.
        """
        cleared = np.zeros(len(labelled), bool)
        if len(labelled) == 0 or len(self._rejected_at) == 0:
            return cleared
        from scipy.spatial import cKDTree

        groups = cluster(labelled, TowerSettings())
        # Groups that are not tower lie beside one, or are too low or sparse.
        label = np.where(groups.tower >= 0, groups.tower, groups.left_out + groups.tower.max() + 1)
        rejected, kept = cKDTree(self._rejected_at), None
        apart, _ = rejected.query(labelled[:, :2])
        others = np.full(len(labelled), np.inf)
        if len(self._kept_at):
            kept = cKDTree(self._kept_at)
            others, _ = kept.query(labelled[:, :2])
        at_rejected = np.unique(label[apart <= HIT_DISTANCE_M])
        return np.isin(label, at_rejected) & (apart < others)

    def apply(self, points: Points, cleared: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The classes and towers of consecutive points.

        Args:
            cleared: (n,) bool, those whose label ends.

        Returns:
            (n,) uint8 class codes, and (n,) id of the tower of each point, 0 for none.
        """
        towers = np.where(np.isin(points.towers, self._kept), points.towers, 0)
        for number, tower in self._added.items():
            structure = tower.structure
            away = np.hypot(points.xyz[:, 0] - structure.x, points.xyz[:, 1] - structure.y)
            free = np.flatnonzero((away <= structure.reach) & (towers == 0))
            towers[free[structure.contains(points.xyz[free])]] = number
        labelled = np.isin(points.codes, self.codes.towers)
        ended = labelled & (cleared | np.isin(points.towers, self._rejected))
        codes = np.where(ended, self.codes.other, points.codes)
        own = np.isin(towers, [*self._accepted, *self._added])
        return np.where(own, self.codes.tower, codes).astype(np.uint8), towers


def _ids(towers: Iterable[ReviewedTower]) -> np.ndarray:
    return np.array([tower.id for tower in towers], np.int64)


def _places(towers: Sequence[ReviewedTower]) -> np.ndarray:
    return np.array([(tower.x, tower.y) for tower in towers]).reshape(-1, 2)
