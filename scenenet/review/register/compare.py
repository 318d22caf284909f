"""A register compared with the towers that were found: where they agree and where they do not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

from scenenet.core.errors import InputError
from scenenet.review.found_list import FoundList
from scenenet.review.register.assets import Assets
from scenenet.review.register.match import match

Status = Literal["missing", "moved", "new", "outside", "without place", "matched"]

STATUSES: dict[Status, str] = {
    "missing": "in the register, and no tower was found there",
    "moved": "found further from its place in the register than the tolerance",
    "new": "found, and not in the register",
    "outside": "in the register, outside the coverage of the survey",
    "without place": "in the register, without coordinates",
    "matched": "found at its place in the register",
}
"""What an entry can be, in the order of the table, and its meaning."""

FAR_M = 10_000.0
"""m from the survey; a register of which no asset is nearer is in another coordinate system."""


@dataclass(frozen=True)
class Entry:
    """An asset, or a tower that no asset has.

    Attributes:
        status: a key of ``STATUSES``.
        asset: id in the register; None for a new tower.
        tower: id in the tower list; None where none was found.
        asset_x, asset_y: place in the register, in the units of the survey; None without one.
        tower_x, tower_y: place of the tower; None without one.
        distance_m: planar distance of the two, m; None unless both are there.
        east_m, north_m: from the place in the register to the tower, m.
    """

    status: Status
    asset: str | None = None
    tower: int | None = None
    asset_x: float | None = None
    asset_y: float | None = None
    tower_x: float | None = None
    tower_y: float | None = None
    distance_m: float | None = None
    east_m: float | None = None
    north_m: float | None = None


@dataclass(frozen=True)
class Comparison:
    """A register compared with a tower list.

    Attributes:
        entries: by status, in the order of ``STATUSES``; those furthest apart first.
        within_m, moved_m: the largest distance of a pair, and the tolerance of its place.
        coverage_known: whether the coverage of the survey is known; if not, every asset without a
            tower is ``missing``.
        shift_m: median of the way east and north from asset to tower over all pairs; None without
            a pair.
    """

    entries: tuple[Entry, ...]
    within_m: float
    moved_m: float
    coverage_known: bool
    shift_m: tuple[float, float] | None

    def counts(self) -> dict[str, int]:
        """Number of entries of each status, of assets and of towers."""
        numbers = {s: sum(entry.status == s for entry in self.entries) for s in STATUSES}
        return {
            "assets": sum(entry.asset is not None for entry in self.entries),
            "towers": sum(entry.tower is not None for entry in self.entries),
            **{status.replace(" ", "_"): number for status, number in numbers.items()},
        }

    def to_json(self) -> dict[str, Any]:
        """All of it as plain values."""
        return {
            "counts": self.counts(),
            "within_m": self.within_m,
            "moved_m": self.moved_m,
            "coverage_known": self.coverage_known,
            "shift_m": None if self.shift_m is None else list(self.shift_m),
            "entries": [asdict(entry) for entry in self.entries],
        }


def compare(found: FoundList, assets: Assets, within_m: float, moved_m: float) -> Comparison:
    """Compare a register with the towers of a survey.

    Args:
        within_m: m, the largest distance between an asset and its tower.
        moved_m: m, the tolerance: a tower further from its place in the register is ``moved``.

    Raises:
        InputError: no asset is anywhere near the survey.
    """
    size = found.unit_sizes[0]
    _require_near(found, assets, size)
    pairs = dict(match(assets.xy * size, found.places * size, within_m))
    covered = _covered(found, assets.xy)
    entries: list[Entry] = [Entry("without place", name) for name in assets.without_place]
    for number, (name, (x, y)) in enumerate(zip(assets.ids, assets.xy.tolist(), strict=True)):
        if number not in pairs:
            status: Status = "missing" if covered[number] else "outside"
            entries.append(Entry(status, name, asset_x=x, asset_y=y))
            continue
        tower = found.towers[pairs[number]]
        east, north = (tower.x - x) * size, (tower.y - y) * size
        apart = float(np.hypot(east, north))
        status = "moved" if apart > moved_m else "matched"
        entries.append(Entry(status, name, tower.id, x, y, tower.x, tower.y, apart, east, north))
    taken = set(pairs.values())
    for number, tower in enumerate(found.towers):
        if number not in taken:
            entries.append(Entry("new", tower=tower.id, tower_x=tower.x, tower_y=tower.y))
    rank = {status: number for number, status in enumerate(STATUSES)}
    entries.sort(key=lambda entry: (rank[entry.status], -(entry.distance_m or 0.0)))
    return Comparison(
        tuple(entries), within_m, moved_m, found.coverage is not None, _shift(entries)
    )


def _covered(found: FoundList, xy: np.ndarray) -> np.ndarray:
    """(N,) bool, which places the survey covers; all where its coverage is not known."""
    import shapely

    if found.coverage is None:
        return np.ones(len(xy), bool)
    shapely.prepare(found.coverage)
    return np.asarray(shapely.covers(found.coverage, shapely.points(xy)), bool)


def _shift(entries: Sequence[Entry]) -> tuple[float, float] | None:
    ways = np.array([(e.east_m, e.north_m) for e in entries if e.distance_m is not None], float)
    if len(ways) == 0:
        return None
    east, north = np.median(ways, axis=0).tolist()
    return east, north


def _require_near(found: FoundList, assets: Assets, size: float) -> None:
    """Refuse a register whose coordinates are those of another place.

    Raises:
        InputError: no asset is within ``FAR_M`` of the survey.
    """
    import shapely

    area = found.coverage
    if area is None or area.is_empty:
        area = shapely.multipoints(found.places)
    if area.is_empty:
        return
    low_x, low_y, high_x, high_y = shapely.bounds(area)
    nearest = shapely.distance(shapely.box(low_x, low_y, high_x, high_y), shapely.points(assets.xy))
    if nearest.min() * size > FAR_M:
        raise InputError(
            f"none of the assets is within {FAR_M / 1000:.0f} km of the survey; the nearest is "
            f"{nearest.min() * size / 1000:.0f} km away",
            file=assets.path,
            remedy="Check the coordinate system of the register (--crs), and the order of its "
            "columns (--x, --y)",
        )
