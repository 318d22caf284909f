"""The observer of a target beside boosted trees and a CNN."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.experiments import observers
from scenenet.pointcloud.targets import Target
from scenenet.training import presets

WIRE = Target.parse("wire")
CONDUCTOR, GROUND, CROWN = 16, 2, 4


def span(seed: int) -> np.ndarray:
    """(N, 4) x, y, z, class: a conductor 11 m above ground, beside a crown."""
    rng = np.random.default_rng(seed)
    ground = np.column_stack([rng.uniform(0, 24, (9000, 2)), rng.normal(0, 0.05, 9000)])
    crown = rng.normal(0, 1, (1500, 3)) * [1.5, 1.5, 1.2] + [6, 6, 4]
    along = np.arange(0, 24, 0.12)
    wire = np.column_stack([along, np.full(len(along), 15.0), 11 + (along - 12) ** 2 / 300])
    parts = ((ground, GROUND), (crown, CROWN), (wire, CONDUCTOR))
    return np.concatenate([np.column_stack([xyz, np.full(len(xyz), c)]) for xyz, c in parts])


@pytest.fixture(scope="module")
def lines(tmp_path_factory):
    folder = tmp_path_factory.mktemp("crops")
    for seed in (0, 1):
        np.save(folder / f"sample_{seed}.npy", span(seed))
    other = tmp_path_factory.mktemp("other") / "sample_9.npy"
    np.save(other, span(9))
    few = presets.OBSERVERS["wire"] | {"search": {"result": "middle", "starts": 16}}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(presets, "OBSERVERS", {"wire": few})
        patch.setattr(presets, "EPOCHS", 2)
        yield observers.table(WIRE, folder, "edp", [other], "edp")


def test_there_is_a_row_for_each_survey_and_the_median(lines):
    head, rule, row, median = lines
    assert "observer" in head and "CNN" in head and "boosted trees" in head
    assert rule.count("---") == 7
    assert row.startswith("| sample_9 |")
    assert median.startswith("| median |")


def test_the_observer_finds_the_conductor_of_a_survey_it_has_not_seen(lines):
    precision_recall, iou = lines[2].split(" | ")[1:3]
    precision, recall = (float(x) for x in precision_recall.split(", "))
    assert min(precision, recall) > 0.8
    assert float(iou) > 0.7
