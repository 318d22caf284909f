"""Models are trained on wrong labels and scored against labels and truth; a rule decides."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from scenenet.dataset.voxels import VoxelSettings
from scenenet.experiments.contenders import Contender, contenders
from scenenet.experiments.label_noise.corridor import noisy_lines
from scenenet.experiments.label_noise.run import COLUMNS, train_with_label_noise
from scenenet.experiments.label_noise.settings import LABELS, LabelNoiseSettings
from scenenet.experiments.label_noise.summary import claim, findings, summarise_label_noise
from scenenet.experiments.train_and_tune import train_and_tune
from scenenet.metrics.voxel_scores import Confusion
from scenenet.models.settings import ModelSettings

GRID = VoxelSettings(resolution=32)
STUDY = LabelNoiseSettings(
    levels=(0, 0.5),
    line={"towers": 8, "density": 20, "tower_density": 5},
    training=3,
    validation=1,
)


@pytest.fixture(scope="module")
def made(models, tmp_path_factory):
    out = tmp_path_factory.mktemp("label_noise") / "runs.csv"
    times = out.with_name("times.csv")
    return train_with_label_noise(STUDY, models, GRID, 0, out, times), out


def test_every_model_at_every_level_and_the_labels(made):
    table, out = made
    assert tuple(table.columns) == COLUMNS == tuple(pd.read_csv(out).columns)
    names = [LABELS, "operational", "scenenet", "cnn", "boosted trees"]
    assert list(table["model"]) == 2 * names
    assert list(table["level"]) == 5 * [0] + 5 * [0.5]
    trained = table[table["model"] != LABELS]
    assert set(trained["training_crops"]) == {3}
    assert set(table["test_crops"]) == {2}  # 8 towers less 3, 1 and the two left out
    assert list(trained["parameters"][:2]) == [11, 11]
    times = pd.read_csv(out.with_name("times.csv"))
    assert list(times.columns) == ["level", "seed", "model", "training_seconds"]
    assert list(times["model"]) == 2 * names[1:], "labels are not trained"
    assert (times["training_seconds"] > 0).all()


def test_without_noise_labels_are_the_truth(made):
    table, _ = made
    clean = table[table["level"] == 0]
    for score in ("precision", "recall", "f05"):
        np.testing.assert_array_equal(clean[f"labels_{score}"], clean[f"truth_{score}"])
    assert clean["wrong_detected"].isna().all()


def test_labels_are_scored_as_if_a_model_had_predicted_them(made, line):
    table, _ = made
    row = table[(table["model"] == LABELS) & (table["level"] == 0.5)].iloc[0]
    _, noisy = noisy_lines(line, (0, 0.5), GRID)
    labelled = sum(int(s.labelled.sum()) for s in noisy.labelled[6:])
    true = sum(int(s.labelled.sum()) for s in noisy.true[6:])
    assert row["truth_precision"] == pytest.approx(true / labelled)
    assert row["truth_recall"] == row["labels_f05"] == row["wrong_detected"] == 1
    assert row["share"] == noisy.share


def test_a_models_scores_are_those_of_the_same_training_by_itself(made, line, models):
    table, _ = made
    _, noisy = noisy_lines(line, (0, 0.5), GRID)
    row = table[(table["model"] == "operational") & (table["level"] == 0.5)].iloc[0]
    tuned = train_and_tune(models[0], noisy.labelled[:3], noisy.labelled[4:5], 0)
    assert row["tau"] == tuned.tau
    assert row["labels_f05"] == tuned.score(noisy.labelled[6:]).f05
    assert row["truth_f05"] == tuned.score(noisy.true[6:]).f05
    against: Confusion = tuned.score(noisy.true[6:])
    assert row["truth_precision"] == against.precision


def test_the_same_seed_gives_the_same_scores(made, models, tmp_path):
    table, _ = made
    times = tmp_path / "times.csv"
    again = train_with_label_noise(STUDY, models[:1], GRID, 0, tmp_path / "again.csv", times)
    same = table["model"].isin([LABELS, "operational", "boosted trees"])
    first = table[same].reset_index(drop=True)
    pd.testing.assert_frame_equal(first, again, check_dtype=False)
    other = train_with_label_noise(STUDY, [], GRID, 1, tmp_path / "other.csv", times)
    assert not set(other["share"][other["level"] > 0]) & set(table["share"])


def runs(f05: dict[str, tuple[float, ...]], wrong: float = 0.1) -> pd.DataFrame:
    """Made-up rows at 0 and 60 % noise; labels have 0.6 there."""
    rows = []
    for seed in range(3):
        for level in (0.0, 0.6):
            own = {LABELS: 0.6 if level else 1.0} | {name: at[seed] for name, at in f05.items()}
            for name, score in own.items():
                row = dict.fromkeys(COLUMNS, 0.5) | {"level": level, "share": level, "seed": seed}
                row |= {"model": name, "alive": True, "truth_f05": score, "wrong_detected": wrong}
                rows.append(row)
    return pd.DataFrame(rows)


def test_the_table_has_means_over_seeds_and_the_gain_over_the_labels():
    table = summarise_label_noise(runs({"a": (0.7, 0.8, 0.5)}))
    assert list(table["model"]) == [LABELS, "a", LABELS, "a"]
    labels, a = table[table["level"] == 0.6].to_dict("records")
    assert a["truth_f05"] == pytest.approx(2 / 3)
    assert a["gain"] == pytest.approx(2 / 3 - 0.6)
    assert a["gain_std"] == pytest.approx(np.std([0.1, 0.2, -0.1], ddof=1))
    assert (a["better_seeds"], a["n_seeds"], a["live_share"]) == (2, 3, 1)
    assert pd.isna(labels["better_seeds"])


@pytest.mark.parametrize(
    ("f05", "wrong", "nearer", "ignores"),
    [
        (
            (0.7, 0.8, 0.65),
            0.1,
            "in all of 3 trainings",
            "It ignores the wrong labels: it detects 10%",
        ),
        ((0.7, 0.8, 0.5), 0.1, "in 2 of 3 trainings", "It ignores"),
        (
            (0.1, 0.2, 0.5),
            0.9,
            "in none of 3 trainings",
            "It does not ignore the wrong labels: it detects 90%",
        ),
    ],
)
def test_the_verdict_follows_from_the_numbers(f05, wrong, nearer, ignores):
    table = summarise_label_noise(runs({"a": f05, "b": (0.9, 0.9, 0.9)}, wrong))
    text = claim(table, {"a": "scenenet", "b": "cnn"})
    assert f"a is nearer to the truth than its labels {nearer}" in text
    assert ignores in text
    assert "b is" not in text  # the claim is SCENE-Net's
    assert any(line.startswith("b: F0.5 0.90") for line in findings(table))


def test_without_a_scenenet_or_noise_there_is_no_verdict():
    table = summarise_label_noise(runs({"b": (0.9, 0.9, 0.9)}))
    assert "not tested" in claim(table, {"b": "cnn"})
    assert "not tested" in claim(table[table["level"] == 0], {"b": "scenenet"})


def test_contenders_are_models_of_the_configuration_with_changes(models):
    entries = (
        Contender(model="cnn", changes={"training.epochs": 9}, name="long"),
        Contender(model="cnn"),
    )
    long, plain = contenders(entries, models, "label_noise")
    assert (long.name, long.training.epochs) == ("long", 9)
    assert plain == models[2]
    assert contenders((), models, "label_noise") == models


@pytest.mark.parametrize(
    ("entries", "named"),
    [
        ([{"model": "cn"}], "'cn' is not one of"),
        ([{"model": "cnn", "changes": {"training.epoch": 3}}], "epoch"),
        ([{"model": "cnn"}, {"model": "cnn"}], "cnn is listed more than once"),
    ],
)
def test_invalid_contenders_are_named(models: list[ModelSettings], entries, named):
    with pytest.raises(ValueError, match=named):
        contenders([Contender(**one) for one in entries], models, "label_noise")


@pytest.mark.parametrize(
    ("fields", "named"),
    [
        ({"line": {"towers": 9}}, "9 towers are too few"),
        ({"line": {"tower": 9}}, r"label_noise\.line: tower"),
        ({"levels": (0.2, 0.2)}, "more than once"),
        ({"levels": (1.0,)}, "less than 1"),
    ],
)
def test_invalid_settings_are_refused(fields, named):
    with pytest.raises(ValueError, match=named):
        LabelNoiseSettings(**fields)
