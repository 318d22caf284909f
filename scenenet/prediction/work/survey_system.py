"""The coordinates of a survey: its CRS and its units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from scenenet.pointcloud.las.crs import same_system
from scenenet.pointcloud.reading import SurveyInfo

if TYPE_CHECKING:
    import pyproj


@dataclass(frozen=True)
class SurveySystem:
    """The coordinates of a survey.

    Attributes:
        crs: its CRS; None where its files name none.
        unit_sizes, unit_names: sizes in m of the units of its x, y and z, and their names.
    """

    crs: pyproj.CRS | None
    unit_sizes: tuple[float, float, float]
    unit_names: tuple[str, str, str]

    @classmethod
    def of(cls, info: SurveyInfo) -> SurveySystem:
        """The coordinates of a file."""
        return cls(info.crs, info.unit_sizes, info.unit_names)

    @property
    def name(self) -> str:
        return self.crs.name if self.crs else "no CRS"

    def is_same(self, other: SurveySystem) -> bool:
        """Whether files with these coordinates can be one survey."""
        return same_system(self.crs, other.crs) and self.unit_sizes == other.unit_sizes

    def to_json(self) -> dict[str, Any]:
        crs = None if self.crs is None else self.crs.srs
        return {"crs": crs, "unit_sizes": self.unit_sizes, "unit_names": self.unit_names}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> SurveySystem:
        """The coordinates that ``to_json`` gave."""
        crs = None if data["crs"] is None else _system(data["crs"])
        return cls(crs, tuple(data["unit_sizes"]), tuple(data["unit_names"]))


@lru_cache(maxsize=16)
def _system(text: str) -> pyproj.CRS:
    """The system of a description; one object of 90 kB for all files of a survey."""
    import pyproj

    return pyproj.CRS(text)


def in_metres(xyz: np.ndarray, unit_sizes: tuple[float, float, float]) -> np.ndarray:
    """Coordinates (n, 3) in units of these sizes, as metres; metres stay the same to the bit."""
    return xyz if unit_sizes == (1.0, 1.0, 1.0) else xyz * unit_sizes
