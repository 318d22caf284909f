"""The point cloud that every stage works with."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from scenenet.core.errors import InputError
from scenenet.pointcloud.class_schemes import SCHEMES, ClassScheme
from scenenet.pointcloud.point_fields import PointFields
from scenenet.pointcloud.targets import TOWER, Target

if TYPE_CHECKING:
    import pyproj


@dataclass(frozen=True)
class PointCloud:
    """Points with class codes.

    Attributes:
        xyz: (N, 3) float64, metres, x east, y north, z up, in the survey's CRS. Never float32: at a
            northing of 4 630 000 m a float32 step is half a metre.
        classification: (N,) uint8 class codes.
        scheme: what the codes mean; None if the user did not name it (it is never guessed).
        crs: coordinate reference system; None if the file names none.
        truth: (N,) uint8 true class codes, where a second file has them; else None.
            ``classification`` are then the labels, which may differ.
        fields: what else is known about the points, for measurements; None where it was not asked
            for.
        withheld: (N,) bool, points that their producer marked as not to be used; None where that is
            not known.
    """

    xyz: np.ndarray
    classification: np.ndarray
    scheme: ClassScheme | None = None
    crs: pyproj.CRS | None = None
    truth: np.ndarray | None = None
    fields: PointFields | None = None
    withheld: np.ndarray | None = None

    def __post_init__(self) -> None:
        xyz, codes = np.asarray(self.xyz), np.asarray(self.classification)
        if xyz.ndim != 2 or xyz.shape[1] != 3 or xyz.dtype != np.float64:
            raise ValueError(f"xyz must be (N, 3) float64, not {xyz.shape} {xyz.dtype}")
        if codes.shape != (len(xyz),) or codes.dtype != np.uint8:
            raise ValueError(
                f"classification must be ({len(xyz)},) uint8, not {codes.shape} {codes.dtype}"
            )
        if self.truth is not None and (
            self.truth.shape != codes.shape or self.truth.dtype != np.uint8
        ):
            raise ValueError(
                f"truth must be ({len(xyz)},) uint8, not {self.truth.shape} {self.truth.dtype}"
            )

    def __len__(self) -> int:
        return len(self.xyz)

    @property
    def is_tower(self) -> np.ndarray:
        """(N,) bool: points labelled tower.

        Raises:
            InputError: the class scheme is not known.
        """
        return self.is_labelled(TOWER)

    @property
    def is_true_tower(self) -> np.ndarray | None:
        """(N,) bool: points that are tower in truth; None where the truth is not known.

        Raises:
            InputError: the class scheme is not known.
        """
        return self.is_truly(TOWER)

    def is_labelled(self, target: Target) -> np.ndarray:
        """(N,) bool: points labelled ``target``.

        Raises:
            InputError: the class scheme is not known.
        """
        return target.among(self.classification, self._known_scheme())

    def is_truly(self, target: Target) -> np.ndarray | None:
        """(N,) bool: points that are ``target`` in truth; None where the truth is not known.

        Raises:
            InputError: the class scheme is not known.
        """
        return None if self.truth is None else target.among(self.truth, self._known_scheme())

    @property
    def with_truth(self) -> PointCloud | None:
        """The same points with their true classes as labels; None where they are not known."""
        return None if self.truth is None else PointCloud(self.xyz, self.truth, self.scheme)

    @property
    def is_ground(self) -> np.ndarray:
        """(N,) bool: points labelled as what looks like bare ground.

        Raises:
            InputError: the class scheme is not known.
        """
        return self._known_scheme().is_ground(self.classification)

    @property
    def roles(self) -> np.ndarray:
        """(N,) what each point is, keys of ``class_schemes.ROLE_COLOURS``.

        Raises:
            InputError: the class scheme is not known.
        """
        return self._known_scheme().roles(self.classification)

    def _known_scheme(self) -> ClassScheme:
        if self.scheme is None:
            raise InputError(
                "the class scheme of the labels is not known",
                remedy=f"Give it as codes (--codes on the command line): {', '.join(SCHEMES)}",
            )
        return self.scheme

    def select(self, index: np.ndarray) -> PointCloud:
        """The points at ``index`` (a mask or positions), in that order."""
        truth = None if self.truth is None else self.truth[index]
        fields = None if self.fields is None else self.fields.select(index)
        classes = self.classification[index]
        withheld = None if self.withheld is None else self.withheld[index]
        return PointCloud(self.xyz[index], classes, self.scheme, self.crs, truth, fields, withheld)
