"""Towers in labelled points: instances and their measures (thesis 5.1.2, Figure 5.2)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

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

LEFT_OUT_COLUMNS = ("x", "y", "points", "height", "reason")
"""x, y: centre of the points, m. points: their number. height: top minus base, m. reason: why these
points labelled tower are not tower."""

DIRECTION_STEP = 3.0
"""Step of the directions in which the base of a tower is measured, degrees."""


class TowerSettings(Settings):
    """DBSCAN of the points labelled tower.

    ``min_points`` is that of the thesis, for surveys with hundreds of points on a tower. A thinner
    survey, a pole, or a tower at the edge of a strip has fewer: what is left is clustered again
    with ``sparse_points``.
    """

    eps: float = Field(
        10.0, gt=0, description="largest distance between neighbouring points of a tower, m"
    )
    min_points: int = Field(
        300, ge=1, description="points that a core point of a tower must have within eps"
    )
    sparse_points: int = Field(
        10, ge=1, description="as min_points, for towers with too few points for it"
    )
    sparse_height: float = Field(
        4.0, ge=0, description="height that a tower found with sparse_points must have, m"
    )
    cell: float = Field(
        1.0,
        gt=0,
        description="points are merged into cells of this size, weighted by their number, m",
    )


@dataclass(frozen=True)
class LabelledTowers:
    """The towers in the labels of a survey.

    Attributes:
        towers: a row per tower with ``COLUMNS``, in order along the line. TS40K samples add
            ``sample``, the name of the sample, and have spacing NaN, because they are single crops.
        left_out: a row per group of points labelled tower that is not a tower, with
            ``LEFT_OUT_COLUMNS``, and ``sample`` as above.
    """

    towers: pd.DataFrame
    left_out: pd.DataFrame

    @classmethod
    def none(cls) -> LabelledTowers:
        """No tower, for labels of something else."""
        return find_towers(np.empty((0, 3)), TowerSettings())

    def notes(self) -> list[str]:
        """A sentence for each row of ``left_out``."""
        return [
            f"{row.points} points labelled tower about x {row.x:.1f}, y {row.y:.1f} are left out: "
            f"{row.reason}"
            for row in self.left_out.itertuples()
        ]


def survey_towers(path: str | Path, codes: str, settings: TowerSettings) -> LabelledTowers:
    """Towers of a labelled survey, of one TS40K sample, or of a folder of TS40K samples.

    Only points labelled tower are kept in memory.

    Raises:
        InputError: a file cannot be read, or its coordinates are known not to be metres.
    """
    samples = sample_files(path)
    if not samples:
        survey_in_metres(path)
        return find_towers(_tower_points(path, codes), settings)
    tables, left_out = [], []
    for sample in samples:
        survey_in_metres(sample)
        found = find_towers(_tower_points(sample, codes), settings)
        tables.append(found.towers.assign(sample=sample.stem, spacing=np.nan))
        left_out.append(found.left_out.assign(sample=sample.stem))
    table = pd.concat(tables, ignore_index=True)
    table["tower"] = np.arange(1, len(table) + 1)
    return LabelledTowers(table, pd.concat(left_out, ignore_index=True))


def find_towers(xyz: np.ndarray, settings: TowerSettings) -> LabelledTowers:
    """Group tower points (N, 3), xyz in m, into instances and measure each."""
    groups = cluster(xyz, settings)
    left_out = pd.DataFrame(_left_out(xyz, groups), columns=list(LEFT_OUT_COLUMNS))
    rows = [_measure(xyz[groups.tower == n]) for n in range(groups.tower.max(initial=-1) + 1)]
    if not rows:
        return LabelledTowers(pd.DataFrame(columns=list(COLUMNS)), left_out)
    table = pd.DataFrame(rows)
    order = line_order(table[["x", "y"]].to_numpy())
    table = table.iloc[order].reset_index(drop=True)
    step = np.diff(table[["x", "y"]].to_numpy(), axis=0)
    table["spacing"] = np.append(np.hypot(step[:, 0], step[:, 1]), np.nan)
    table.insert(0, "tower", np.arange(1, len(table) + 1))
    return LabelledTowers(table[list(COLUMNS)], left_out)


@dataclass(frozen=True)
class Groups:
    """Points labelled tower in groups.

    Attributes:
        tower: (N,) int, the tower of each point from 0; -1 for none.
        left_out: (N,) int, the group of each point that is not a tower from 0; -1 for points of a
            tower.
        reasons: of each group of ``left_out``, why it is not a tower.
    """

    tower: np.ndarray
    left_out: np.ndarray
    reasons: tuple[str, ...]


def cluster(xyz: np.ndarray, settings: TowerSettings) -> Groups:
    """The tower of each point (N, 3), xyz in m, by DBSCAN.

    A second DBSCAN, with ``sparse_points``, groups the points that the first leaves. Such a group
    is a tower if it is ``sparse_height`` high and lies further from every tower than twice ``eps``:
    nearer, it is a part of that tower, or of something beside it that was labelled wrongly.
    """
    tower = _dbscan(xyz, settings.min_points, settings)
    left_out = np.full(len(xyz), -1)
    reasons: list[str] = []
    rest = np.flatnonzero(tower < 0)
    sparse = _dbscan(xyz[rest], settings.sparse_points, settings)
    dense = xyz[tower >= 0]
    for label in range(sparse.max(initial=-1) + 1):
        rows = rest[sparse == label]
        reason = _why_no_tower(xyz[rows], dense, settings)
        if reason is None:
            tower[rows] = tower.max() + 1
        else:
            left_out[rows] = len(reasons)
            reasons.append(reason)
    if len(scattered := rest[sparse < 0]):
        left_out[scattered] = len(reasons)
        fewest = settings.sparse_points
        reasons.append(f"fewer than {fewest} of them lie within {settings.eps:g} m")
    return Groups(tower, left_out, tuple(reasons))


def _why_no_tower(xyz: np.ndarray, dense: np.ndarray, settings: TowerSettings) -> str | None:
    """Why a group (n, 3) of few points is not a tower; None if it is one.

    Args:
        dense: (N, 3) points of the towers with ``min_points``.
    """
    height = np.ptp(xyz[:, 2])
    if height < settings.sparse_height:
        return f"they are {height:.1f} m high, less than {settings.sparse_height:g} m"
    nearest = np.hypot(*(dense[:, :2] - np.median(xyz[:, :2], axis=0)).T).min(initial=np.inf)
    if nearest <= 2 * settings.eps:
        return f"they lie {nearest:.1f} m beside a tower with more points"
    return None


def _left_out(xyz: np.ndarray, groups: Groups) -> list[dict[str, Any]]:
    """The rows of ``LabelledTowers.left_out``."""
    parts = [xyz[groups.left_out == label] for label in range(len(groups.reasons))]
    return [
        {
            "x": np.median(part[:, 0]),
            "y": np.median(part[:, 1]),
            "points": len(part),
            "height": np.ptp(part[:, 2]),
            "reason": reason,
        }
        for part, reason in zip(parts, groups.reasons, strict=True)
    ]


def _dbscan(xyz: np.ndarray, min_points: int, settings: TowerSettings) -> np.ndarray:
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
    dbscan = DBSCAN(eps=settings.eps, min_samples=min_points)
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
    sides = np.sort(_sides(xyz[xyz[:, 2] <= (base + top) / 2, :2]))
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


def _sides(xy: np.ndarray) -> np.ndarray:
    """Sides (2,), m, of the rectangle of least area around points (n, 2), in any direction, without
    the outer 2 % to each side. A square has no main axes, so they would be drawn across corners.
    """
    angles = np.radians(np.arange(0.0, 90.0, DIRECTION_STEP))
    along = np.stack([np.cos(angles), np.sin(angles)])
    across = np.stack([-np.sin(angles), np.cos(angles)])
    centred = xy - xy.mean(axis=0)
    low, high = np.percentile(np.stack([centred @ along, centred @ across]), [2, 98], axis=1)
    sides = high - low
    return sides[:, int(np.argmin(sides.prod(axis=0)))]


def _tower_points(path: str | Path, codes: str) -> np.ndarray:
    parts = [chunk.xyz[chunk.is_tower] for chunk in iter_chunks(path, codes)]
    return np.concatenate([*parts, np.empty((0, 3))])
