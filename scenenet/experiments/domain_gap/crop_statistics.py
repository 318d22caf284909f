"""Statistics of a crop around a tower, with units (thesis 5.1.1, 5.1.2 and 5.1.4).

They measure how similar two sets of crops are, such as real and synthetic ones. They are computed
from the points and their EDP codes alone, as the public TS40K crops use them (see
docs/method/synthetic.md): 2, 10 and 19 are ground, 11 is low vegetation, 5 and 12 are taller
objects.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from scenenet.dataset.voxels import VoxelGrid, VoxelSample, voxelise
from scenenet.pointcloud.cloud import PointCloud

GROUND, LOW, TALL, STRAY, CONDUCTOR, TOWER = (2, 10, 19), (11,), (5, 12), (7,), (16,), (15,)
CODES = (1, 2, 3, 4, 5, 7, 10, 11, 12, 15, 16, 19)
RESOLUTIONS = (64, 128)
CELL_M = 1.0
"""Cell of the maps of ground and canopy."""
SHADOW_CELL_M = 0.5
NEAR_GROUND_M = 1.5
OFF_BODY_M = 0.8
"""Points labelled tower below the first or beyond the second are probably mislabelled."""
CLEAR_OF_ALL_M = 3.0
"""A return at least this far above vegetation and tower counts as a stray return."""

PROPERTIES: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "points": ("", "points"),
        "density": ("1/m²", "points per area with returns"),
        "shadow": ("%", "0.5 m cells inside the crop without any return"),
        "spacing": ("m", "median distance of a return to the nearest other one"),
        "evenness": ("", "ratio of that distance to that of random points, on open ground"),
        "extent": ("m", "longest side of the bounding box, which determines the voxel size"),
        "tower_height": ("m", "height of the labelled tower"),
        "occupied_64": ("%", "occupied voxels, 64³"),
        "occupied_128": ("%", "occupied voxels, 128³"),
        "tower_voxels_64": ("", "tower voxels, 64³"),
        "tower_voxels_128": ("", "tower voxels, 128³"),
        "tower_points": ("", "points labelled tower"),
        "tower_near_ground": ("%", "tower points within 1.5 m of the ground"),
        "tower_wrong": (
            "%",
            "tower points within 1.5 m of the ground, or 0.8 m or more off the axis",
        ),
        "tower_body": ("1/m", "tower points of the body between 3 m and the arms, per m of height"),
        "strays": ("", "stray returns above everything"),
        "stray_height": ("m", "median height of the stray returns above the ground"),
        "stray_top": ("m", "greatest height of the stray returns above the ground"),
        "ground_density": ("1/m²", "returns from the ground per area of the crop"),
        "low_density": ("1/m²", "returns from low vegetation per area of the crop"),
        "tall_density": ("1/m²", "returns from tall vegetation per area of the crop"),
        "slope": ("°", "slope of a plane fitted to the ground"),
        "roughness": ("m", "standard deviation of the ground from that plane"),
        "canopy_cover": ("%", "1 m cells with returns above 2 m"),
        "canopy_height": ("m", "95th percentile of tall vegetation above the ground"),
        "canopy_middle": ("m", "median of tall vegetation above the ground"),
        "canopy_gaps": ("%", "1 m cells below the canopy with returns from the ground"),
        "wire_density": ("1/m", "conductor points per m of line"),
        "wires": ("", "conductors side by side"),
        "wire_spacing": ("m", "distance of a conductor to the nearest other one"),
        "wire_height": ("m", "median height of the conductors above the ground"),
        "wire_curvature": ("1/km", "curvature of a conductor; sag = span² curvature / 8"),
        **{f"class_{code}": ("%", f"points in class {code}") for code in CODES},
    }
)
"""Name of each property -> unit and meaning."""


def crop_statistics(cloud: PointCloud) -> dict[str, float]:
    """The properties ``PROPERTIES`` of one crop; NaN if a property cannot be measured.

    Args:
        cloud: a crop around one tower, EDP codes.
    """
    from scipy.spatial import cKDTree

    xyz = cloud.xyz - cloud.xyz.min(axis=0)
    codes = cloud.classification
    height = xyz[:, 2] - ground_elevation(xyz, np.isin(codes, GROUND))
    cell = np.unique(np.floor(xyz[:, :2] / CELL_M).astype(int), axis=0)
    area = len(cell) * CELL_M**2
    gap = cKDTree(xyz).query(xyz, k=2)[0][:, 1]
    return {
        "points": float(len(xyz)),
        "density": len(xyz) / area,
        "shadow": 100
        * _shadow(np.unique(np.floor(xyz[:, :2] / SHADOW_CELL_M).astype(int), axis=0)),
        "spacing": float(np.median(gap)),
        "evenness": _evenness(xyz[np.isin(codes, GROUND)]),
        "extent": float(np.ptp(xyz, axis=0).max()),
        **_voxels(cloud),
        **_tower(xyz, codes, height),
        **_strays(codes, height),
        **{
            f"{name}_density": float(np.isin(codes, which).sum()) / area
            for name, which in (("ground", GROUND), ("low", LOW), ("tall", TALL))
        },
        **_ground(xyz[np.isin(codes, GROUND)]),
        **_canopy(xyz, codes, height, len(cell)),
        **_conductors(xyz, codes, height),
        **{f"class_{code}": 100 * float((codes == code).mean()) for code in CODES},
    }


def voxel_statistics(sample: VoxelSample) -> dict[str, float]:
    """Distribution of the occupied voxels of a crop: shares and percentiles, without units.

    Numbers of neighbours, points per voxel and columns: the input of models that use the
    neighbourhood of a voxel.
    """
    nz, ny, nx = sample.grid.shape
    grid = np.zeros((nz + 2, ny + 2, nx + 2), np.int8)
    z, y, x = np.unravel_index(sample.index, sample.grid.shape)
    grid[z + 1, y + 1, x + 1] = 1
    offsets = [
        (dz, dy, dx) for dz in (-1, 0, 1) for dy in (-1, 0, 1) for dx in (-1, 0, 1)
        if (dz, dy, dx) != (0, 0, 0)
    ]  # fmt: skip
    neighbours = np.sum(
        [grid[z + 1 + dz, y + 1 + dy, x + 1 + dx] for dz, dy, dx in offsets], axis=0
    )
    column = grid[1:-1, 1:-1, 1:-1].sum(axis=0)
    column = column[column > 0]
    top, bottom = z.max(), z.min()
    return {
        **{f"filling_{q}": float(np.percentile(sample.count, q)) for q in (10, 50, 90, 99)},
        **{f"neighbours_{q}": float(np.percentile(neighbours, q)) for q in (10, 50, 90)},
        "alone": float((neighbours == 0).mean()),
        **{f"column_{q}": float(np.percentile(column, q)) for q in (50, 90, 99)},
        "above": float(grid[z + 2, y + 1, x + 1].mean()),
        "level_50": float((np.median(z) - bottom) / max(top - bottom, 1)),
        "level_90": float((np.percentile(z, 90) - bottom) / max(top - bottom, 1)),
    }


def ground_elevation(xyz: np.ndarray, ground: np.ndarray) -> np.ndarray:
    """Elevation (N,) m of the ground at points (N, 3), from those that are ``ground`` (N,) bool.

    Inverse-distance weights of the nearest ground returns; the lowest elevation if there is no
    ground return.
    """
    from scipy.spatial import cKDTree

    if not ground.any():
        return np.full(len(xyz), xyz[:, 2].min())
    known = xyz[ground]
    k = min(6, len(known))
    distance, which = cKDTree(known[:, :2]).query(xyz[:, :2], k=k)
    distance, which = distance.reshape(len(xyz), k), which.reshape(len(xyz), k)
    weight = 1 / (distance + 0.1) ** 2
    return (known[which, 2] * weight).sum(axis=1) / weight.sum(axis=1)


def line_direction(xy: np.ndarray) -> np.ndarray:
    """Unit vector (2,) of the direction in which positions (N, 2) spread most."""
    return np.linalg.svd(xy - xy.mean(axis=0), full_matrices=False)[2][0]


def _shadow(cell: np.ndarray) -> float:
    """Share of the cells between the first and last of each row that are not in ``cell`` (C, 2)."""
    between = 0
    for row in np.unique(cell[:, 0]):
        columns = cell[cell[:, 0] == row, 1]
        between += int(np.ptp(columns)) + 1
    return 1 - len(cell) / between


def _evenness(ground: np.ndarray) -> float:
    """Clark and Evans' ratio of ground returns (N, 3) in well covered cells: 1 random, 2.1 a
    triangular grid."""
    from scipy.spatial import cKDTree

    if len(ground) < 50:
        return float("nan")
    _, inverse, count = np.unique(
        np.floor(ground[:, :2] / CELL_M), axis=0, return_inverse=True, return_counts=True
    )
    gap = cKDTree(ground[:, :2]).query(ground[:, :2], k=2)[0][:, 1]
    inverse = inverse.reshape(-1)
    full = count[inverse] >= 0.7 * np.percentile(count, 90)
    expected = 0.5 / np.sqrt(count[inverse] / CELL_M**2)
    return float((gap[full] / expected[full]).mean())


def _voxels(cloud: PointCloud) -> dict[str, float]:
    found = {}
    for resolution in RESOLUTIONS:
        sample = voxelise(cloud, VoxelGrid.cube(cloud.xyz, resolution))
        found[f"occupied_{resolution}"] = 100 * len(sample.index) / sample.grid.n_voxels
        found[f"tower_voxels_{resolution}"] = float(sample.labelled.sum())
    return found


def _tower(xyz: np.ndarray, codes: np.ndarray, height: np.ndarray) -> dict[str, float]:
    is_tower = np.isin(codes, TOWER)
    names = ("tower_height", "tower_points", "tower_near_ground", "tower_wrong", "tower_body")
    if is_tower.sum() < 10:
        return dict.fromkeys(names, float("nan"))
    points, above = xyz[is_tower], height[is_tower]
    tall = float(np.ptp(points[:, 2]))
    body = (above > NEAR_GROUND_M) & (above < 0.85 * tall)
    axis = np.median(points[body if body.any() else slice(None), :2], axis=0)
    off = np.linalg.norm(points[:, :2] - axis, axis=1) > OFF_BODY_M
    low = above < NEAR_GROUND_M
    middle = (above > 3.0) & (above < tall - 4.0) & ~off
    values = (
        tall,
        float(len(points)),
        100 * float(low.mean()),
        100 * float((low | off).mean()),
        float(middle.sum()) / max(tall - 7.0, 1.0),
    )
    return dict(zip(names, values, strict=True))


def _strays(codes: np.ndarray, height: np.ndarray) -> dict[str, float]:
    solid = height[np.isin(codes, (*LOW, *TALL, *TOWER))]
    roof = np.percentile(solid, 99.5) if len(solid) else 0.0
    up = height[np.isin(codes, STRAY) & (height > roof + CLEAR_OF_ALL_M)]
    return {
        "strays": float(len(up)),
        "stray_height": float(np.median(up)) if len(up) else float("nan"),
        "stray_top": float(up.max()) if len(up) else float("nan"),
    }


def _ground(ground: np.ndarray) -> dict[str, float]:
    if len(ground) < 10:
        return {"slope": float("nan"), "roughness": float("nan")}
    centred = ground - ground.mean(axis=0)
    plane = np.linalg.lstsq(centred[:, :2], centred[:, 2], rcond=None)[0]
    rest = centred[:, 2] - centred[:, :2] @ plane
    return {
        "slope": float(np.degrees(np.arctan(np.linalg.norm(plane)))),
        "roughness": float(rest.std()),
    }


def _canopy(xyz: np.ndarray, codes: np.ndarray, height: np.ndarray, cells: int) -> dict[str, float]:
    tall = np.isin(codes, TALL) & (height > 2.0)

    def covered(which: np.ndarray) -> set[tuple[int, int]]:
        return set(map(tuple, np.floor(xyz[which, :2] / CELL_M).astype(int).tolist()))

    below = covered(tall)
    seen = below & covered(np.isin(codes, GROUND))
    values = height[tall]
    return {
        "canopy_cover": 100 * len(below) / cells,
        "canopy_height": float(np.percentile(values, 95)) if len(values) else float("nan"),
        "canopy_middle": float(np.median(values)) if len(values) else float("nan"),
        "canopy_gaps": 100 * len(seen) / len(below) if below else float("nan"),
    }


def _conductors(xyz: np.ndarray, codes: np.ndarray, height: np.ndarray) -> dict[str, float]:
    from sklearn.cluster import DBSCAN

    names = ("wire_density", "wires", "wire_spacing", "wire_height", "wire_curvature")
    is_conductor = np.isin(codes, CONDUCTOR)
    if is_conductor.sum() < 30:
        return dict.fromkeys(names, float("nan"))
    points = xyz[is_conductor]
    along_axis = line_direction(points[:, :2])
    centred = points[:, :2] - points[:, :2].mean(axis=0)
    along, across = centred @ along_axis, centred @ [-along_axis[1], along_axis[0]]
    # The common sag is subtracted; the rest separates the conductors.
    level = points[:, 2] - np.polyval(np.polyfit(along, points[:, 2], 2), along)
    section = np.column_stack((across, level))
    label = DBSCAN(eps=0.35, min_samples=8).fit_predict(section)
    found = [label == k for k in range(label.max() + 1)]
    centres = np.array([section[members].mean(axis=0) for members in found]).reshape(-1, 2)
    distance = np.linalg.norm(centres[:, None] - centres, axis=2) + np.diag([np.inf] * len(centres))
    bends = [
        2000 * np.polyfit(along[members], points[members, 2], 2)[0]
        for members in found if np.ptp(along[members]) > 10.0
    ]  # fmt: skip
    values = (
        len(points) / max(float(np.ptp(along)), 1.0),
        float(len(found)),
        float(np.median(distance.min(axis=1))) if len(centres) > 1 else float("nan"),
        float(np.median(height[is_conductor])),
        float(np.median(bends)) if bends else float("nan"),
    )
    return dict(zip(names, values, strict=True))
