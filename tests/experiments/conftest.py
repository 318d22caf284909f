"""Few boosted trees, because no test of an experiment looks at how good they are."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from scenenet.baselines.boosted_trees import BoostedTreesSettings
from scenenet.experiments import train_and_tune


@pytest.fixture(scope="session", autouse=True)
def few_trees() -> Iterator[BoostedTreesSettings]:
    """The settings of the boosted trees that experiments train."""
    settings = BoostedTreesSettings(trees=15)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(train_and_tune, "BoostedTreesSettings", lambda: settings)
        yield settings
