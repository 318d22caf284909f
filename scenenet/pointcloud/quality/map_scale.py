"""Lengths on the map of a coordinate system against lengths on the ground."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import pyproj

DISTORTED = 0.01
"""Largest difference between 1 and the length of a metre on the map. UTM has 0.001 at most within
its zone; Web Mercator 0.32 at 41 degrees."""
MARGIN = 2.0
"""Degrees beyond the area of a system up to which its use is common."""


def map_findings(crs: pyproj.CRS, centre: np.ndarray) -> list[tuple[str, str]]:
    """(kind, text) of what is wrong with a projected system at a place (x, y) of its map."""
    import pyproj

    plane = _plane(crs)
    if plane is None or plane.geodetic_crs is None:
        return []
    try:
        to_degrees = pyproj.Transformer.from_crs(plane, plane.geodetic_crs, always_xy=True)
        longitude, latitude = to_degrees.transform(*centre)
        factors = pyproj.Proj(plane).get_factors(longitude, latitude)
    except pyproj.exceptions.ProjError:
        return []
    if not np.isfinite([longitude, latitude]).all() or _is_outside(plane, longitude, latitude):
        return [
            (
                "area",
                f"the coordinates ({centre[0]:.0f}, {centre[1]:.0f}) lie outside the area of the "
                f"coordinate system {plane.name}: it may be the wrong one, or x and y are swapped",
            )
        ]
    scales = np.array([factors.meridional_scale, factors.parallel_scale])
    worst = scales[np.argmax(np.abs(scales - 1))]
    if not abs(worst - 1) > DISTORTED:
        return []
    return [
        (
            "distortion",
            f"a metre on the ground is {worst:.2f} m on the map of {plane.name} here, so towers "
            "and distances have the wrong size. Reproject the survey to a local system such as "
            "its UTM zone first",
        )
    ]


def _plane(crs: pyproj.CRS) -> pyproj.CRS | None:
    """The projected part of a system; None if it has none."""
    if crs.is_bound and crs.source_crs is not None:
        return _plane(crs.source_crs)
    if crs.is_compound:
        return _plane(crs.sub_crs_list[0])
    return crs if crs.is_projected else None


def _is_outside(plane: pyproj.CRS, longitude: float, latitude: float) -> bool:
    area = plane.area_of_use
    if area is None:
        return False
    # Across the 180th meridian, west is greater than east.
    width = (area.east - area.west) % 360 or 360
    east_of_west = (longitude - area.west + MARGIN) % 360
    in_longitude = width + 2 * MARGIN >= 360 or east_of_west <= width + 2 * MARGIN
    return not (in_longitude and area.south - MARGIN <= latitude <= area.north + MARGIN)
