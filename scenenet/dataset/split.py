"""Split into training, validation and test parts, by stretch of line (thesis 5.2.1)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from pydantic import Field, model_validator

from scenenet.core.errors import InputError
from scenenet.core.files import read_json
from scenenet.core.settings import Settings
from scenenet.dataset.labelled_towers import line_order

PARTS = ("train", "validation", "test")
GUARD = "guard"
"""Part of a crop that is left out because its neighbours are in different parts."""


class SplitSettings(Settings):
    """Shares of the parts, and which crops are neighbours."""

    train: float = Field(0.2, gt=0, le=1, description="share of the crops to train on")
    validation: float = Field(0.1, ge=0, lt=1, description="share of the crops to tune on")
    test: float = Field(0.7, ge=0, lt=1, description="share of the crops to test on")
    stretch: int = Field(4, ge=1, description="consecutive towers that stay together")
    neighbour: float = Field(
        500.0,
        ge=0,
        description="consecutive towers nearer than this have the same surroundings and are never "
        "in different parts, m (thesis 5.1.2: towers are up to 500 m apart)",
    )
    seed: int = Field(0, ge=0, description="seed of the random split")

    @model_validator(mode="after")
    def _shares_are_all(self) -> SplitSettings:
        if abs(self.train + self.validation + self.test - 1) > 1e-6:
            raise ValueError("train, validation and test must sum to 1")
        return self

    def parts(self) -> list[str]:
        """The parts with a share above 0."""
        return [part for part in PARTS if getattr(self, part) > 0]


def split_crops(manifests: Sequence[str | Path], settings: SplitSettings) -> pd.DataFrame:
    """Assign every crop of the surveys to a part.

    Each line is cut into stretches of consecutive towers, and whole stretches are assigned at
    random. Where adjacent stretches of a line are in different parts, one crop at the border is
    left out as ``guard``, so that no crop has a neighbour in another part. Crops that overlap are
    always in the same part.

    Args:
        manifests: of the crop stores.

    Returns:
        a row per crop: survey, crop, stretch, part (train, validation, test or guard), x, y, m.

    Raises:
        InputError: there are too few crops for all parts.
    """
    tables = [_stretches(path, settings) for path in manifests]
    table = pd.concat(tables, ignore_index=True) if tables else pd.DataFrame()
    wanted = settings.parts()
    if len(table) < len(wanted):
        raise InputError(
            f"{len(table)} crops cannot be split into {', '.join(wanted)}",
            remedy="Add surveys with labelled towers to the sheet, role train",
        )
    table["part"] = table["stretch"].map(_draw(table["stretch"], settings))
    table.loc[_guards(table), "part"] = GUARD
    missing = [part for part in wanted if part not in set(table["part"])]
    if missing:
        raise InputError(
            f"no crop remains for {', '.join(missing)} out of {len(table)} crops in "
            f"{table['stretch'].nunique()} stretches of line",
            remedy="Add surveys, or set split.stretch or split.neighbour lower",
        )
    return table[["survey", "crop", "stretch", "part", "x", "y"]]


def crops_in(split: str | Path, part: str) -> set[str]:
    """Ids of the crops that the file ``split`` assigns to ``part``."""
    table = pd.read_csv(split, dtype={"crop": str})
    return set(table.loc[table["part"] == part, "crop"])


def _stretches(manifest: str | Path, settings: SplitSettings) -> pd.DataFrame:
    """Crops of one survey along its line, with the name of the stretch, and whether the previous
    crop is a neighbour."""
    facts = read_json(manifest)
    crops = pd.DataFrame(facts["crops"], columns=["id", "x", "y", "radius"])
    crops = crops.iloc[line_order(crops[["x", "y"]].to_numpy(float))].reset_index(drop=True)
    xy, radius = crops[["x", "y"]].to_numpy(float), crops["radius"].to_numpy(float)
    step = np.linalg.norm(np.diff(xy, axis=0), axis=1)
    overlap = np.append(False, step < radius[1:] + radius[:-1])[: len(crops)]
    is_neighbour = np.append(False, step < settings.neighbour)[: len(crops)]
    numbers, number, length = [], -1, 0
    for i in range(len(crops)):
        apart = not is_neighbour[i] or (length >= settings.stretch and not overlap[i])
        if i == 0 or apart:
            number, length = number + 1, 0
        length += 1
        numbers.append(number)
    joined = _sharing_ground(np.array(numbers, int), xy, radius)
    return pd.DataFrame(
        {
            "survey": facts["survey"],
            "crop": crops["id"],
            "stretch": [f"{facts['survey']}-{number + 1:03d}" for number in joined],
            "x": crops["x"],
            "y": crops["y"],
            "next_to_previous": is_neighbour,
        }
    )


def _sharing_ground(stretch: np.ndarray, xy: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """Numbers of the stretches (C,) from 0, after stretches with overlapping crops were merged.

    A line may return to the same place, and lines may cross, so towers that are not consecutive
    can have overlapping crops.
    """
    if len(stretch) == 0:
        return stretch
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    pairs = cKDTree(xy).query_pairs(2 * radius.max(), output_type="ndarray")
    a, b = pairs.T
    share = np.linalg.norm(xy[a] - xy[b], axis=1) < radius[a] + radius[b]
    a, b = stretch[a[share]], stretch[b[share]]
    shape = (stretch.max() + 1,) * 2
    _, joined = connected_components(coo_array((np.ones(len(a)), (a, b)), shape), directed=False)
    return joined[stretch]


def _draw(stretch: pd.Series, settings: SplitSettings) -> dict[str, str]:
    """Part of each stretch: in random order, each goes to the part that is furthest from its
    share."""
    sizes = stretch.value_counts(sort=False)
    order = np.random.default_rng(settings.seed).permutation(len(sizes))
    wanted = {part: getattr(settings, part) * len(stretch) for part in settings.parts()}
    filled = dict.fromkeys(wanted, 0)
    drawn = {}
    for i in order:
        name, size = sizes.index[i], int(sizes.iloc[i])
        part = max(wanted, key=lambda p: (wanted[p] - filled[p]) / wanted[p])
        drawn[name] = part
        filled[part] += size
    return drawn


def _guards(table: pd.DataFrame) -> np.ndarray:
    """Positions of the crops to leave out: at each border the one whose part has more crops."""
    size = table["part"].value_counts()
    guards = []
    for i in np.flatnonzero(table["next_to_previous"]):
        before, after = table["part"].iloc[i - 1], table["part"].iloc[i]
        if before != after and (i - 1) not in guards:
            guards.append(i - 1 if size[before] >= size[after] else i)
    return table.index[guards]
