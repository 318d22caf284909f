"""What a study came to is said by rule, and not more than the numbers say."""

from __future__ import annotations

import pandas as pd

from scenenet.experiments.studies.findings import as_good_as_best, findings
from scenenet.experiments.studies.settings import StudySettings


def study(n_seeds: int = 4) -> StudySettings:
    return StudySettings(
        name="s", title="t", place="5", asks="?", seeds=range(n_seeds), variants=[{"name": "a"}]
    )


def summary(rows: dict[str, tuple], n_seeds: int = 4) -> pd.DataFrame:
    """Of variant -> (F0.5, its deviation, alive, share of seeds with a negative number)."""
    names = ["f05", "f05_std", "alive", "negative_share"]
    frame = pd.DataFrame(rows.values(), columns=names)
    return frame.assign(variant=list(rows), n_seeds=n_seeds)


def test_best_and_lowest_and_what_is_as_good():
    # The error of a difference is sqrt(0.04^2 / 4 + 0.04^2 / 4) = 0.028: 0.45 is within two.
    frame = summary(
        {"a": (0.40, 0.04, 4, 0), "b": (0.50, 0.04, 4, 0), "c": (0.45, 0.04, 4, 0)}
    )  # fmt: skip
    assert list(as_good_as_best(frame)) == [False, True, True]
    assert findings(study(), frame) == (
        "Best here: b with an F0.5 of 0.50 ± 0.04. Lowest: a with an F0.5 of 0.40 ± 0.04. "
        "As good as the best within 2 standard errors: c."
    )


def test_one_seed_tells_nothing_of_spread():
    frame = summary({"a": (0.4, float("nan"), 1, 0), "b": (0.5, float("nan"), 1, 0)}, 1)
    said = findings(study(1), frame)
    assert "b with an F0.5 of 0.50. Lowest" in said
    assert "One seed" in said
    assert "standard error" not in said


def test_the_dead_are_named_with_how_many_they_are():
    frame = summary({"a": (0.4, 0.0, 4, 0), "b": (0.1, 0.0, 1, 0)})
    assert "Dead after training: b (3 of 4)." in findings(study(), frame)
    many = {f"v{i}": (0.1, 0.0, 0, 0) for i in range(9)} | {"good": (0.4, 0.0, 4, 0)}
    assert "Dead after training: 9 of 10." in findings(study(), summary(many))


def test_nothing_found_is_not_a_best():
    frame = summary({"a": (0.0, 0.0, 0, 0), "b": (0.0, 0.0, 0, 0)})
    assert findings(study(), frame) == "None of them finds a tower voxel."


def test_negative_numbers_are_told_where_variants_differ_in_them():
    told = findings(study(), summary({"a": (0.4, 0.1, 4, 0.25), "b": (0.4, 0.1, 4, 0.75)}))
    assert "A number below zero is left by: a 1 of 4 seeds, b 3 of 4 seeds." in told
    same = findings(study(), summary({"a": (0.4, 0.1, 4, 0.5), "b": (0.4, 0.1, 4, 0.5)}))
    assert "below zero" not in same
    cnn = findings(study(), summary({"a": (0.4, 0.1, 4, 0.5), "b": (0.4, 0.1, 4, float("nan"))}))
    assert "below zero" not in cnn
