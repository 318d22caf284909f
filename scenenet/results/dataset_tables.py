"""Tables of the dataset: classes, towers, voxelisation (thesis 5.1)."""

from __future__ import annotations

import pandas as pd

from scenenet.experiments.published import Thesis
from scenenet.results.folder import Results


def classes(results: Results, thesis: Thesis) -> pd.DataFrame:
    """Table 5.1: share of each class in the points of all surveys together.

    ``lowest_percent`` and ``highest_percent`` are the lowest and the highest share in a single
    survey. Classes of the EDP scheme have the share of the thesis, too; classes that only the
    thesis lists have a share of zero.
    """
    columns = ["code", "class", "points", "share_percent", "lowest_percent", "highest_percent",
               "thesis_percent"]  # fmt: skip
    counts = results.class_counts()
    if not counts:
        return pd.DataFrame(columns=columns)
    long = pd.concat(counts, names=["survey"]).reset_index("survey")
    points = long.pivot_table(
        index=["code", "class"], columns="survey", values="points", aggfunc="sum", fill_value=0
    )
    share = 100 * points / points.sum()
    ours = pd.DataFrame(
        {
            "points": points.sum(axis=1),
            "share_percent": 100 * points.sum(axis=1) / points.to_numpy().sum(),
            "lowest_percent": share.min(axis=1),
            "highest_percent": share.max(axis=1),
        }
    )
    published = pd.Series(_published_classes(thesis), dtype=float, name="thesis_percent")
    published.index = published.index.set_names(["code", "class"])
    both = ours.join(published, how="outer").reset_index()
    filled = dict.fromkeys(["points", "share_percent", "lowest_percent", "highest_percent"], 0)
    return both.fillna(filled).astype({"points": int})[columns]


def towers(results: Results, thesis: Thesis) -> pd.DataFrame:
    """Properties of the labelled towers (thesis 5.1.2), one row per property."""
    columns = ["property", "unit", "towers", "mean", "std", "lowest", "highest",
               "thesis_mean", "thesis_lowest", "thesis_highest"]  # fmt: skip
    tables = [table for table in results.towers().values() if len(table)]
    if not tables:
        return pd.DataFrame(columns=columns)
    every = pd.concat(tables)
    rows = []
    for name, unit in (("points", ""), ("width", "m"), ("length", "m"), ("height", "m"),
                       ("spacing", "m")):  # fmt: skip
        values = every[name].dropna()
        ours = (len(values), values.mean(), values.std(), values.min(), values.max())
        published = [thesis.value(f"towers.{name}", part) for part in ("value", "low", "high")]
        rows.append((name, unit, *ours, *published))
    return pd.DataFrame(rows, columns=columns)


def voxelisation(results: Results, thesis: Thesis) -> pd.DataFrame:
    """Time and size of voxelised crops (thesis 5.1.4), one row per grid.

    ``seconds`` is the mean time for one crop without reading files.
    """
    columns = ["grid", "samples", "seconds", "seconds_std", "occupied_voxels", "tower_voxels",
               "tower_share_percent", "thesis_seconds"]  # fmt: skip
    timed = results.grid_times()
    rows = []
    for grid, crops in () if timed is None else timed.groupby("grid", sort=False):
        occupied, tower = crops["occupied"], crops["tower"]
        rows.append(
            (
                grid,
                len(crops),
                crops["seconds"].mean(),
                crops["seconds"].std(),
                occupied.mean(),
                tower.mean(),
                100 * tower.sum() / occupied.sum(),
                thesis.value(f"voxelisation.{str(grid).removeprefix('cube-')}"),
            )
        )
    return pd.DataFrame(rows, columns=columns)


def _published_classes(thesis: Thesis) -> dict[tuple[int, str], float | None]:
    """(code, class) of the EDP scheme -> share, %."""
    return {
        (int(name.removeprefix("class_share.")), number.what or ""): number.value
        for name, number in thesis.numbers.items()
        if name.startswith("class_share.")
    }
