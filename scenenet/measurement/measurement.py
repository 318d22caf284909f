"""What a measurement is: a number from 0 to 1 for each occupied voxel."""

from __future__ import annotations

from abc import ABC
from dataclasses import dataclass
from typing import ClassVar, Literal, get_args

import numpy as np

from scenenet.core.errors import InputError
from scenenet.pointcloud.point_fields import FIELDS, PointField, PointFields

Need = PointField | Literal["fullest", "height"]
"""What a measurement may look at besides the numbers of points: fields of the points, the fullest
voxel of the survey, the height of a voxel above the ground."""
NEEDS: tuple[str, ...] = (*FIELDS, *get_args(Literal["fullest", "height"]))

STEPS = 65535
"""Steps between 0 and 1 in which the value of a point is kept. Sums of whole numbers do not depend
on the order of the points, so phi is the same wherever a survey is cut."""


@dataclass(frozen=True)
class MeasuredVoxels:
    """What is known about M occupied voxels.

    Attributes:
        count: (M,) number of points in each.
        mean: (M,) float64, the mean of ``Measurement.of_points`` over its points; None for a
            measurement that looks at no field of the points.
        fullest: number of points in the fullest voxel of the survey, or of the crop in training;
            None for a measurement that does not need it.
        height: (M,) float64, m above the ground (``scenenet.measurement.heights``); None for a
            measurement that does not need it.
    """

    count: np.ndarray
    mean: np.ndarray | None = None
    fullest: int | None = None
    height: np.ndarray | None = None


class Measurement(ABC):
    """A measurement phi. It sees no coordinates, so it moves with the scene.

    A measurement of points overrides ``of_points``; phi of a voxel is then the mean over its
    points. One of voxels overrides ``of_voxels``.

    Attributes:
        name: in settings and model files; that of its file.
        needs: what it looks at, of ``NEEDS``.
    """

    name: ClassVar[str]
    needs: ClassVar[frozenset[Need]] = frozenset()

    def of_points(self, points: PointFields) -> np.ndarray:
        """(N,) values from 0 to 1 of N points; asked for if ``needs`` has a field of the points."""
        raise NotImplementedError(f"{self.name} needs fields of the points, and measures none")

    def of_voxels(self, voxels: MeasuredVoxels) -> np.ndarray:
        """(M,) phi from 0 to 1 of M voxels; by default the mean of their points."""
        if voxels.mean is None:
            raise NotImplementedError(f"{self.name} measures neither points nor voxels")
        return voxels.mean

    @property
    def fields(self) -> tuple[PointField, ...]:
        """The fields of the points that it needs."""
        return tuple(field for field in FIELDS if field in self.needs)

    def point_steps(self, points: PointFields) -> np.ndarray:
        """(N,) uint16, ``of_points`` in steps of 1 / ``STEPS``.

        Raises:
            InputError: a value is not in [0, 1].
        """
        values = self._checked(self.of_points(points), len(points), "points")
        return np.rint(values * STEPS).astype(np.uint16)

    def phi(self, voxels: MeasuredVoxels) -> np.ndarray:
        """(M,) float32, ``of_voxels``.

        Raises:
            InputError: a value is not in [0, 1].
        """
        values = self._checked(self.of_voxels(voxels), len(voxels.count), "voxels")
        return values.astype(np.float32)

    def _checked(self, values: np.ndarray, n: int, what: str) -> np.ndarray:
        found = np.asarray(values, float)
        fault = None
        if found.shape != (n,):
            fault = f"gives an array of {found.shape} for {n} {what}, and phi is one number each"
        elif n and not ((found >= 0) & (found <= 1)).all():  # NaN is neither
            row = int(np.argmax(~((found >= 0) & (found <= 1))))
            fault = f"gives {found[row]:g} for one of the {what}, and phi lies in [0, 1]"
        if fault is not None:
            raise InputError(
                f"the measurement {self.name!r} {fault}",
                remedy="Correct it; clip or scale its values",
            )
        return found
