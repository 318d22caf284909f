"""The table of each contest, by its name: that of its folder, file, figure and experiment."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from scenenet.contests.cross_table import summarise_folds
from scenenet.contests.noise_table import summarise_noise

if TYPE_CHECKING:
    import pandas as pd

CONTEST_TABLES: Mapping[str, Callable[[pd.DataFrame], pd.DataFrame]] = {
    "cross_validation": summarise_folds,
    "noise": summarise_noise,
}
