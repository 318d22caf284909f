"""The experiments: what each is called and which table it makes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from scenenet.experiments.cross_validation.summary import summarise_folds
from scenenet.experiments.label_noise.summary import summarise_noise

if TYPE_CHECKING:
    import pandas as pd


EXPERIMENT_TABLES: Mapping[str, Callable[[pd.DataFrame], pd.DataFrame]] = {
    "cross_validation": summarise_folds,
    "label_noise": summarise_noise,
}
