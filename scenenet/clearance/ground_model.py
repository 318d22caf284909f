"""The ground below a section of a line as a raster."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

CELL_M = 1.0
"""m, edge of the cells."""

OPENINGS = (1, 2, 4, 7, 11, 16)
"""Cells, radii of the openings that remove objects, up to roofs of 33 m."""

SLOPE, STEP_M = 0.35, 0.3
"""What rises over an opening by more than this share of its radius, and this much in m, is no
ground."""

TREND, REST_SLOPE = 6.0, 0.12
"""Cells, width over which the ground is smoothed to take its slope off; ``SLOPE`` of the rest."""

PIT_M = 2.0
"""m below its neighbours from which a cell has a stray return below the ground."""

SMOOTHED = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
"""Cells, widths over which gaps in the ground are filled from what is around them; the first that
reaches ground counts."""


@dataclass(frozen=True)
class GroundModel:
    """Elevation of the ground in square cells.

    Attributes:
        corner: (2,) m, x and y of the centre of the first cell.
        z: (rows, columns) m, rows northwards.
        steepness: (rows, columns) rise in m per m.
    """

    corner: np.ndarray
    z: np.ndarray
    steepness: np.ndarray

    def height(self, xy: np.ndarray) -> np.ndarray:
        """z (n,), m, at places (n, 2) m; at the border's height beyond it."""
        return self._read(self.z, xy)

    def slope(self, xy: np.ndarray) -> np.ndarray:
        """Rise (n,) in m per m at places (n, 2) m."""
        return self._read(self.steepness, xy)

    def _read(self, raster: np.ndarray, xy: np.ndarray) -> np.ndarray:
        at = ((xy - self.corner) / CELL_M).T[::-1]
        return np.asarray(ndimage.map_coordinates(raster, at, order=1, mode="nearest"))

    @classmethod
    def from_ground(cls, xyz: np.ndarray, box: np.ndarray) -> GroundModel:
        """From points (n, 3) m that are known to be on the ground, at least one.

        Args:
            box: (2, 2) m, lowest and highest x and y to cover.
        """
        corner, shape, flat = _cells(xyz, box)
        count = np.bincount(flat, minlength=shape[0] * shape[1]).reshape(shape)
        total = np.bincount(flat, weights=xyz[:, 2], minlength=count.size).reshape(shape)
        known = count > 0
        return cls._of(corner, np.where(known, total / np.maximum(count, 1), 0.0), known)

    @classmethod
    def from_points(cls, xyz: np.ndarray, box: np.ndarray) -> GroundModel:
        """From points (n, 3) m of which the lowest are mostly on the ground, at least one: a
        progressive morphological filter (Pingel, Clarke and McBride 2013, simplified).

        Args:
            box: as ``from_ground``.
        """
        corner, shape, flat = _cells(xyz, box)
        lowest, place = np.full(shape[0] * shape[1], np.inf), np.zeros((shape[0] * shape[1], 2))
        np.minimum.at(lowest, flat, xyz[:, 2])
        own = xyz[:, 2] == lowest[flat]
        place[flat[own]] = xyz[own, :2]
        lowest = lowest.reshape(shape)
        seen = np.isfinite(lowest)
        nearest = ndimage.distance_transform_edt(~seen, return_indices=True)[1]
        surface = lowest[tuple(nearest)]
        closed = ndimage.grey_closing(surface, size=3)
        pits = closed - surface > PIT_M
        surface = np.where(pits, closed, surface)
        ground = _opened(surface, seen & ~pits, SLOPE)
        # Without its slope the ground is nearly level, so that low and wide bushes stand out.
        trend = ndimage.gaussian_filter(cls._of(corner, surface, ground).z, TREND)
        ground = _opened(surface - trend, ground, REST_SLOPE)
        model = cls._of(corner, surface, ground)
        # On a slope the lowest point of a cell lies at its lower side, not in its centre.
        lower = model.height(place).reshape(shape)
        return cls._of(corner, surface + np.where(ground, model.z - lower, 0.0), ground)

    @classmethod
    def _of(cls, corner: np.ndarray, z: np.ndarray, known: np.ndarray) -> GroundModel:
        """With the elevation of cells that are not ``known`` from those around them."""
        rows, columns = np.nonzero(known)
        design = np.column_stack((rows, columns, np.ones(len(rows))))
        plane, *_ = np.linalg.lstsq(design, z[known], rcond=None)
        tilt = plane[0] * np.arange(z.shape[0])[:, None] + plane[1] * np.arange(z.shape[1])
        tilt += plane[2]
        rest, weight = np.where(known, z - tilt, 0.0), known.astype(float)
        filled, left = rest.copy(), ~known
        for width in SMOOTHED:
            if not left.any():
                break
            near = ndimage.gaussian_filter(weight, width, mode="constant")
            mean = ndimage.gaussian_filter(rest, width, mode="constant") / np.maximum(near, 1e-12)
            reached = left & (near > 0.02)
            filled[reached] = mean[reached]
            left &= ~reached
        north, east = np.gradient(ndimage.gaussian_filter(filled + tilt, 1.0), CELL_M)
        return cls(corner, filled + tilt, np.hypot(north, east))


def _opened(surface: np.ndarray, ground: np.ndarray, slope: float) -> np.ndarray:
    """The cells of ``ground`` that do not rise over openings of ``surface``; all if none is left.

    Args:
        slope: share of the radius of an opening that ground may rise over it.
    """
    left, last = ground, surface
    for radius in OPENINGS:
        opened = ndimage.grey_opening(last, size=2 * radius + 1)
        left = left & (last - opened <= slope * radius * CELL_M + STEP_M)
        last = opened
    return left if left.any() else ground


def _cells(xyz: np.ndarray, box: np.ndarray) -> tuple[np.ndarray, tuple[int, int], np.ndarray]:
    """Centre of the first cell (2,), number of rows and columns, and the cell of each point."""
    corner = np.floor(box[0] / CELL_M)
    columns, rows = (np.floor(box[1] / CELL_M) - corner).astype(int) + 1
    shape = (max(int(rows), 2), max(int(columns), 2))
    at = np.floor(xyz[:, :2] / CELL_M).astype(int) - corner.astype(int)
    at = np.clip(at, 0, (shape[1] - 1, shape[0] - 1))
    return (corner + 0.5) * CELL_M, shape, at[:, 1] * shape[1] + at[:, 0]
