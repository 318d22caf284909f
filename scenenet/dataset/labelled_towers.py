"""Towers in labelled points: instances and their measures (thesis 5.1.2, Figure 5.2)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from pydantic import Field

from scenenet.core.settings import Settings
from scenenet.pointcloud import iter_chunks, survey_in_metres
from scenenet.pointcloud.ts40k import sample_files

COLUMNS = ("tower", "x", "y", "base", "top", "height", "width", "length", "points", "spacing")
"""tower: number from 1, along the line. x, y: centre, m. base, top: elevations, m. height: top
minus base. width, length: sides of the base, m, width <= length. points: labelled points. spacing:
m to the next tower along the line, NaN for the last."""


class TowerSettings(Settings):
    """DBSCAN of the points labelled tower."""

    eps: float = Field(
        10.0, gt=0, description="largest distance between neighbouring points of a tower, m"
    )
    min_points: int = Field(
        300, ge=1, description="points that a core point of a tower must have within eps"
    )
    cell: float = Field(
        1.0,
        gt=0,
        description="points are merged into cells of this size, weighted by their number, m",
    )


def survey_towers(path: str | Path, codes: str, settings: TowerSettings) -> pd.DataFrame:
    """Towers of a labelled survey, of one TS40K sample, or of a folder of TS40K samples.

    Only points labelled tower are kept in memory.

    Returns:
        a row per tower with ``COLUMNS``; TS40K samples add ``sample``, the name of the sample, and
        have spacing NaN, because they are single crops.
    """
    samples = sample_files(path)
    if not samples:
        survey_in_metres(path)
        return find_towers(_tower_points(path, codes), settings)
    tables = []
    for sample in samples:
        found = find_towers(_tower_points(sample, codes), settings)
        tables.append(found.assign(sample=sample.stem, spacing=np.nan))
    table = pd.concat(tables, ignore_index=True)
    table["tower"] = np.arange(1, len(table) + 1)
    return table


def find_towers(xyz: np.ndarray, settings: TowerSettings) -> pd.DataFrame:
    """Group tower points (N, 3), xyz in m, into instances and measure each.

    Returns:
        a row per tower with ``COLUMNS``, in order along the line.
    """
    labels = cluster(xyz, settings)
    rows = [_measure(xyz[labels == label]) for label in range(labels.max(initial=-1) + 1)]
    if not rows:
        return pd.DataFrame(columns=list(COLUMNS))
    table = pd.DataFrame(rows)
    order = line_order(table[["x", "y"]].to_numpy())
    table = table.iloc[order].reset_index(drop=True)
    step = np.diff(table[["x", "y"]].to_numpy(), axis=0)
    table["spacing"] = np.append(np.hypot(step[:, 0], step[:, 1]), np.nan)
    table.insert(0, "tower", np.arange(1, len(table) + 1))
    return table[list(COLUMNS)]


def cluster(xyz: np.ndarray, settings: TowerSettings) -> np.ndarray:
    """DBSCAN instance of each point (N, 3): (N,) int from 0, -1 for noise.

    The memory of DBSCAN grows with the square of the points of a tower, so it gets one weighted
    point per cell; the clusters are the same (docs/development/architecture.md).
    """
    if len(xyz) == 0:
        return np.empty(0, int)
    from sklearn.cluster import DBSCAN

    local = xyz - xyz.min(axis=0)
    cells = np.floor(local / settings.cell).astype(np.int64)
    _, cell_of, count = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    cell_of = cell_of.reshape(-1)  # numpy 2.0 gives (N, 1), later ones (N,)
    sums = np.stack([np.bincount(cell_of, weights=axis) for axis in local.T], axis=1)
    centre = sums / count[:, None]
    dbscan = DBSCAN(eps=settings.eps, min_samples=settings.min_points)
    return dbscan.fit_predict(centre, sample_weight=count)[cell_of]


def line_order(xy: np.ndarray) -> np.ndarray:
    """Order (T,) of towers (T, 2), xy in m, along their line: from one end, always to the nearest
    tower that is left."""
    if len(xy) < 3:
        return np.arange(len(xy))
    centred = xy - xy.mean(axis=0)
    along = centred @ np.linalg.svd(centred, full_matrices=False)[2][0]
    left = list(range(len(xy)))
    order = [left.pop(int(np.argmin(along)))]
    while left:
        nearest = int(np.argmin(np.linalg.norm(xy[left] - xy[order[-1]], axis=1)))
        order.append(left.pop(nearest))
    return np.asarray(order)


def _measure(xyz: np.ndarray) -> dict[str, float | int]:
    """Attributes of one tower from its points (n, 3)."""
    base, top = xyz[:, 2].min(), xyz[:, 2].max()
    # Cells, not points: the side with more points must not shift the centre.
    cells = np.unique(np.floor(xyz[:, :2] * 2), axis=0) / 2 + 0.25
    x, y = np.median(cells, axis=0)
    lower = xyz[xyz[:, 2] <= (base + top) / 2, :2]
    centred = lower - lower.mean(axis=0)
    axes = np.linalg.svd(centred, full_matrices=False)[2]
    low, high = np.percentile(centred @ axes.T, [2, 98], axis=0)
    sides = np.sort(high - low)
    return {
        "x": x,
        "y": y,
        "base": base,
        "top": top,
        "height": top - base,
        "width": sides[0],
        "length": sides[-1],
        "points": len(xyz),
    }


def _tower_points(path: str | Path, codes: str) -> np.ndarray:
    parts = [chunk.xyz[chunk.is_tower] for chunk in iter_chunks(path, codes)]
    return np.concatenate([*parts, np.empty((0, 3))])
