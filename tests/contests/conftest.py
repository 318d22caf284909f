"""Short synthetic lines."""

from __future__ import annotations

import pytest

from scenenet.protocol import ModelSettings, SearchSettings, TrainingSettings
from scenenet.synthetic import SyntheticSettings

LINE = {"towers": 8, "density": 20, "tower_density": 5}


@pytest.fixture(scope="session")
def line() -> SyntheticSettings:
    return SyntheticSettings(**LINE, seed=100)


@pytest.fixture(scope="session")
def models() -> list[ModelSettings]:
    """One of each kind, trained for seconds."""
    search = SearchSettings(searches=1, trial=1, starts=8, population=6, generations=3)
    return [
        ModelSettings(name="field", kind="scenenet", protocol="field", search=search),
        ModelSettings(
            name="scenenet",
            kind="scenenet",
            kernel_size=(5, 5, 5),
            training=TrainingSettings(epochs=2, learning_rate=0.01, batch_size=2),
        ),
        ModelSettings(
            name="cnn",
            kind="cnn",
            kernel_size=(5, 5, 5),
            training=TrainingSettings(epochs=2, init="field"),
        ),
    ]
