"""Tables of the dataset: classes, towers, voxelisation (thesis 5.1)."""

from __future__ import annotations

import pandas as pd

from scenenet.experiments.published import Thesis
from scenenet.results.folder import Results

TOWER_PROPERTIES = (
    ("points", ""),
    ("width", "m"),
    ("length", "m"),
    ("height", "m"),
    ("spacing", "m"),
)
"""Columns of a table of towers (``scenenet.dataset.labelled_towers``) with their units."""


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
    for name, unit in TOWER_PROPERTIES:
        published = [thesis.value(f"towers.{name}", part) for part in ("value", "low", "high")]
        rows.append((name, unit, *_spread(every[name].dropna()), *published))
    return pd.DataFrame(rows, columns=columns)


def dataset(results: Results, thesis: Thesis) -> pd.DataFrame:
    """The crops, and the true towers in them (thesis 5.1.1 to 5.1.3), one row per property.

    ``value`` is the mean, that of ``crops`` their number, and that of ``wrong`` the share of all
    points labelled tower, of which ``lowest`` and ``highest`` are those of a survey. Towers are
    true ones, without annotation noise; table ``towers`` has the same properties of the labels.
    """
    columns = ["property", "unit", "counted", "value", "std", "lowest", "highest", "thesis",
               "thesis_lowest", "thesis_highest"]  # fmt: skip
    crops = results.crops()
    if not any(crops.values()):
        return pd.DataFrame(columns=columns)
    every = pd.DataFrame([entry for entries in crops.values() for entry in entries])
    number = len(every)
    rows = [("crops", "", number, number, *[None] * 3, thesis.value("data.crops"), None, None)]
    rows.append(("points of a crop", "", *_spread(every["points"]), None, None, None))
    if "wrong" in every and every["wrong"].notna().all() and every["labelled"].sum():
        shares = [
            100 * sum(entry["wrong"] for entry in entries) / labelled
            for entries in crops.values()
            if (labelled := sum(entry["labelled"] for entry in entries))
        ]
        whole = 100 * every["wrong"].sum() / every["labelled"].sum()
        rows.append(("wrong", "%", int(every["labelled"].sum()), whole, None, min(shares),
                     max(shares), thesis.value("data.mislabelled_share"), None, None))  # fmt: skip
    if true := list(results.true_towers().values()):
        towers = pd.concat(true)
        for name, unit in TOWER_PROPERTIES:
            published = [thesis.value(f"towers.{name}", part) for part in ("value", "low", "high")]
            rows.append((f"true {name}", unit, *_spread(towers[name].dropna()), *published))
    return pd.DataFrame(rows, columns=columns)


def _spread(values: pd.Series) -> tuple[float, ...]:
    """Number, mean, standard deviation, least and greatest."""
    return len(values), values.mean(), values.std(), values.min(), values.max()


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
