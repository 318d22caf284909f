"""The point cloud that every stage works with."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from scenenet.core.errors import InputError
from scenenet.pointcloud.class_schemes import SCHEMES, ClassScheme

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
    """

    xyz: np.ndarray
    classification: np.ndarray
    scheme: ClassScheme | None = None
    crs: pyproj.CRS | None = None

    def __post_init__(self) -> None:
        xyz, codes = np.asarray(self.xyz), np.asarray(self.classification)
        if xyz.ndim != 2 or xyz.shape[1] != 3 or xyz.dtype != np.float64:
            raise ValueError(f"xyz must be (N, 3) float64, not {xyz.shape} {xyz.dtype}")
        if codes.shape != (len(xyz),) or codes.dtype != np.uint8:
            raise ValueError(
                f"classification must be ({len(xyz)},) uint8, not {codes.shape} {codes.dtype}"
            )

    def __len__(self) -> int:
        return len(self.xyz)

    @property
    def is_tower(self) -> np.ndarray:
        """(N,) bool: points labelled tower.

        Raises:
            InputError: the class scheme is not known.
        """
        return self._known_scheme().is_tower(self.classification)

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
        return PointCloud(self.xyz[index], self.classification[index], self.scheme, self.crs)
