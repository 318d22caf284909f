"""The ground below a section of a line as a raster."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenenet.clearance.bilinear import bilinear_at
from scenenet.clearance.gaussian import gaussian_at

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

REACHED = 0.02
"""Share of the weight of a Gaussian that known cells have, from which it reaches them."""


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
        return bilinear_at(raster, self.corner, CELL_M, xy)

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
        gaps = _Gaps.of(known)
        return cls._of(corner, gaps.filled(np.where(known, total / np.maximum(count, 1), 0.0)))

    @classmethod
    def from_points(cls, xyz: np.ndarray, box: np.ndarray) -> GroundModel:
        """From points (n, 3) m of which the lowest are mostly on the ground, at least one: a
        progressive morphological filter (Pingel, Clarke and McBride 2013, simplified).

        Args:
            box: as ``from_ground``.
        """
        from scipy import ndimage

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
        trend = ndimage.gaussian_filter(_Gaps.of(ground).filled(surface), TREND)
        ground = _opened(surface - trend, ground, REST_SLOPE)
        gaps = _Gaps.of(ground)
        model = cls._of(corner, gaps.filled(surface))
        # On a slope the lowest point of a cell lies at its lower side, not in its centre.
        lower = model.height(place).reshape(shape)
        return cls._of(corner, gaps.filled(surface + np.where(ground, model.z - lower, 0.0)))

    @classmethod
    def _of(cls, corner: np.ndarray, z: np.ndarray) -> GroundModel:
        """From the elevation of every cell."""
        from scipy import ndimage

        north, east = np.gradient(ndimage.gaussian_filter(z, 1.0), CELL_M)
        return cls(corner, z, np.hypot(north, east))


@dataclass(frozen=True)
class _Gaps:
    """The cells of a raster whose values are not known, and what they are filled from.

    Attributes:
        known: (rows, columns) bool.
        filled_from: width of a Gaussian, cells that it reaches with this and no smaller one, row
            and column (n,) of each, and the share (n,) of its weight that known cells have there.
    """

    known: np.ndarray
    filled_from: tuple[tuple[float, tuple[np.ndarray, np.ndarray], np.ndarray], ...]

    @classmethod
    def of(cls, known: np.ndarray) -> _Gaps:
        """Those of a raster with some cells ``known``, at least one."""
        weight = known.astype(float)
        rows, columns = np.nonzero(~known)
        found = []
        for width in SMOOTHED:
            if not len(rows):
                break
            near = gaussian_at(weight, width, (rows, columns))
            reached = near > REACHED
            found.append((width, (rows[reached], columns[reached]), near[reached]))
            rows, columns = rows[~reached], columns[~reached]
        return cls(known, tuple(found))

    def filled(self, z: np.ndarray) -> np.ndarray:
        """Elevations (rows, columns), m, with those of cells that are not known from those around
        them."""
        rows, columns = np.nonzero(self.known)
        design = np.column_stack((rows, columns, np.ones(len(rows))))
        plane, *_ = np.linalg.lstsq(design, z[self.known], rcond=None)
        tilt = plane[0] * np.arange(z.shape[0])[:, None] + plane[1] * np.arange(z.shape[1])
        tilt += plane[2]
        rest = np.where(self.known, z - tilt, 0.0)
        filled = rest.copy()
        for width, cells, near in self.filled_from:
            filled[cells] = gaussian_at(rest, width, cells) / near
        return filled + tilt


def _opened(surface: np.ndarray, ground: np.ndarray, slope: float) -> np.ndarray:
    """The cells of ``ground`` that do not rise over openings of ``surface``; all if none is left.

    Args:
        slope: share of the radius of an opening that ground may rise over it.
    """
    from scipy import ndimage

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
    # Axis by axis, which is several times as fast as both together.
    column, row = (
        np.clip(np.floor(xyz[:, axis] / CELL_M).astype(int) - int(corner[axis]), 0, most - 1)
        for axis, most in enumerate(shape[::-1])
    )
    return (corner + 0.5) * CELL_M, shape, row * shape[1] + column
