"""The findings of a study follow from its numbers by rule."""

from __future__ import annotations

import pandas as pd

from scenenet.experiments.studies.findings import as_good_as_best, findings
from scenenet.experiments.studies.settings import StudySettings


def study(n_seeds: int = 4) -> StudySettings:
    return StudySettings(
        name="s", title="t", place="5", asks="?", seeds=range(n_seeds), variants=[{"name": "a"}]
    )


def summary(rows: dict[str, tuple], n_seeds: int = 4) -> pd.DataFrame:
    """From variant -> (F0.5, its deviation, live models, share of seeds with a negative
    parameter)."""
    names = ["f05", "f05_std", "alive", "negative_share"]
    frame = pd.DataFrame(rows.values(), columns=names)
    return frame.assign(variant=list(rows), n_seeds=n_seeds)


def test_best_lowest_and_equal_variants():
    # The error of a difference is sqrt(0.04^2 / 4 + 0.04^2 / 4) = 0.028: 0.45 is within two.
    frame = summary(
        {"a": (0.40, 0.04, 4, 0), "b": (0.50, 0.04, 4, 0), "c": (0.45, 0.04, 4, 0)}
    )  # fmt: skip
    assert list(as_good_as_best(frame)) == [False, True, True]
    assert findings(study(), frame) == (
        "Best: b with F0.5 0.50 ± 0.04. Lowest: a with F0.5 0.40 ± 0.04. "
        "Equal to the best within 2 standard errors: c."
    )


def test_one_seed_has_no_spread_in_the_findings():
    frame = summary({"a": (0.4, float("nan"), 1, 0), "b": (0.5, float("nan"), 1, 0)}, 1)
    text = findings(study(1), frame)
    assert "b with F0.5 0.50. Lowest" in text
    assert "one seed" in text
    assert "standard error" not in text


def test_variants_with_dead_models_are_named_with_their_number():
    frame = summary({"a": (0.4, 0.0, 4, 0), "b": (0.1, 0.0, 1, 0)})
    assert "Dead models: b (3 of 4)." in findings(study(), frame)
    many = {f"v{i}": (0.1, 0.0, 0, 0) for i in range(9)} | {"good": (0.4, 0.0, 4, 0)}
    assert "Dead models: 9 of 10." in findings(study(), summary(many))


def test_a_study_without_detections_has_no_best_variant():
    frame = summary({"a": (0.0, 0.0, 0, 0), "b": (0.0, 0.0, 0, 0)})
    assert findings(study(), frame) == "No variant detects a tower voxel."


def test_negative_parameters_are_reported_if_the_variants_differ_in_them():
    text = findings(study(), summary({"a": (0.4, 0.1, 4, 0.25), "b": (0.4, 0.1, 4, 0.75)}))
    assert "Ends with a negative parameter: a (1 of 4 seeds), b (3 of 4 seeds)." in text
    same = findings(study(), summary({"a": (0.4, 0.1, 4, 0.5), "b": (0.4, 0.1, 4, 0.5)}))
    assert "negative" not in same
    cnn = findings(study(), summary({"a": (0.4, 0.1, 4, 0.5), "b": (0.4, 0.1, 4, float("nan"))}))
    assert "negative" not in cnn
