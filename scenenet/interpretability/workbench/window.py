"""A square of a survey, so that a kernel can be tried on surveys larger than memory."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scenenet.core.errors import InputError
from scenenet.core.progress import track
from scenenet.pointcloud import PointCloud, iter_chunks
from scenenet.pointcloud.class_schemes import class_scheme

WHOLE = 2_000_000
"""Points of the largest survey that is tried as a whole where no square is named."""
WINDOW_M = 200.0
"""m, edge of the square of a larger one."""


@dataclass(frozen=True)
class Window:
    """A square of the ground plan.

    Attributes:
        x, y: its middle, m, in the coordinates of the survey.
        edge: m.
    """

    x: float
    y: float
    edge: float

    def inside(self, xyz: np.ndarray) -> np.ndarray:
        """(N,) bool, which of the points (N, 3) m are in the square."""
        away = np.abs(xyz[:, :2] - (self.x, self.y)).max(axis=1)
        return np.asarray(away <= self.edge / 2)


def middle_of(survey: str | Path, n_points: int) -> tuple[float, float]:
    """x and y, m, of the point in the middle of a file of ``n_points``: there is something there,
    unlike in the middle of the bounding box of a line."""
    before = 0
    for chunk in track(iter_chunks(survey), f"{Path(survey).name}: middle looked for"):
        if before + len(chunk) > n_points // 2:
            x, y = chunk.xyz[n_points // 2 - before, :2].tolist()
            return x, y
        before += len(chunk)
    raise InputError("the file has fewer points than its header says", file=survey)


def points_in(survey: str | Path, window: Window, codes: str | None) -> PointCloud:
    """The points of a survey in a square; memory is bounded by a chunk and the square.

    Raises:
        InputError: the survey cannot be read, or has no point there.
    """
    xyz, classes, low, high = [], [], np.full(2, np.inf), np.full(2, -np.inf)
    for chunk in track(iter_chunks(survey, codes), f"{Path(survey).name}: square read"):
        rows = window.inside(chunk.xyz)
        xyz.append(chunk.xyz[rows])
        classes.append(chunk.classification[rows])
        low = np.minimum(low, chunk.xyz[:, :2].min(axis=0))
        high = np.maximum(high, chunk.xyz[:, :2].max(axis=0))
    if not sum(map(len, xyz)):
        raise InputError(
            f"there is no point within {window.edge / 2:g} m of ({window.x:.2f}, {window.y:.2f})",
            file=survey,
            remedy=f"Its points lie from ({low[0]:.2f}, {low[1]:.2f}) to ({high[0]:.2f}, "
            f"{high[1]:.2f}): name another place with --at",
        )
    scheme = None if codes is None else class_scheme(codes)
    return PointCloud(np.concatenate(xyz), np.concatenate(classes), scheme)
