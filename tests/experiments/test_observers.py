"""The observer of a target beside boosted trees and a CNN."""

from __future__ import annotations

import laspy
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
        train = observers.Labelled([folder], "edp", WIRE)
        bare = other.with_name("bare.npy")
        np.save(bare, span(9)[:9000])  # ground
        yield observers.table(train, [observers.Labelled([other, bare], "edp", WIRE)], (0, 1))


def test_there_is_a_row_for_each_survey_and_the_median(lines):
    head, rule, row, bare, median = lines
    assert "observer" in head and "CNN" in head and "boosted trees" in head
    assert rule.count("---") == 8
    assert row.startswith("| sample_9 |")
    assert bare.startswith("| bare | none there | 0.0% taken |")
    assert median.startswith("| median |")


def test_the_last_column_is_the_share_of_the_target(lines):
    points = span(9)
    share = (points[:, 3] == CONDUCTOR).mean()
    assert lines[2].endswith(f" | {share:.2f} |")
    assert lines[-1].endswith(f" | {share:.2f} |")


def test_surveys_are_cut_into_squares_to_train_on(tmp_path):
    points = span(0)
    las = laspy.LasData(laspy.LasHeader(point_format=6, version="1.4"))
    las.xyz, las.classification = points[:, :3], points[:, 3].astype(np.uint8)
    las.write(tmp_path / "line.las")
    (crop,) = observers.crops_of(observers.Labelled([tmp_path / "line.las"], "edp", WIRE), 0.5)
    assert crop.count.sum() == len(points) and crop.labelled.any()


def test_the_observer_finds_the_conductor_of_a_survey_it_has_not_seen(lines):
    precision_recall, iou = lines[2].split(" | ")[1:3]
    precision, recall = (float(x) for x in precision_recall.split(", "))
    assert min(precision, recall) > 0.8
    mean, low = iou.replace(")", "").split(" (")
    assert 0.7 < float(low.split(" to ")[0]) <= float(mean)
