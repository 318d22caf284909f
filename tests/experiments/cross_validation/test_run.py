"""For each seed, every crop is scored once by a model that was not trained on it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from scenenet.dataset.crops import CropClouds, CropSettings, Truth, crop_of, cut_crops
from scenenet.dataset.folds import folds
from scenenet.dataset.labelled_towers import TowerSettings, survey_towers
from scenenet.dataset.voxel_cache import build, load
from scenenet.dataset.voxels import VoxelSettings
from scenenet.detection.settings import DetectionSettings
from scenenet.evaluation.answers import rules_on
from scenenet.experiments.cross_validation.run import (
    COLUMNS,
    cross_validate,
    run_folds,
)
from scenenet.experiments.cross_validation.summary import ranking, summarise_folds
from scenenet.experiments.train_and_tune import train_and_tune
from scenenet.metrics.score_columns import AT_TAU, SCORES, WHOLE_TOWERS
from scenenet.synthetic import SyntheticSettings, make_survey

DETECTION = DetectionSettings()
GRID = VoxelSettings(resolution=32)


@pytest.fixture(scope="module")
def manifest(tmp_path_factory):
    """Voxels of a synthetic line, from the stages of the workflow."""
    folder = tmp_path_factory.mktemp("crossed")
    line = SyntheticSettings(towers=6, seed=4, density=12, tower_density=24)
    survey, truth = folder / "line.laz", folder / "line.truth.laz"
    make_survey(line, survey, truth=truth)
    towers, true = (survey_towers(path, "edp", TowerSettings()).towers for path in (survey, truth))
    crops = folder / "crops.json"
    cut_crops("line", survey, "edp", towers, CropSettings(), folder / "crops.zarr.zip", crops,
              Truth(truth, true))  # fmt: skip
    build(crops, GRID, folder / "voxels.zarr.zip", folder / "voxels.json")
    return folder / "voxels.json"


def rows_of(manifest, dataset, model, leave_out):
    """The rows of one seed."""
    clouds = CropClouds([manifest.with_name("crops.json")])
    return run_folds(dataset, clouds, model, (0,), leave_out, 0.0, DETECTION)


def test_a_row_for_every_seed_and_fold(manifest, models, tmp_path):
    thesis = models[1]
    files = tmp_path / "runs.csv", tmp_path / "times.csv"
    both = cross_validate(
        [manifest], [manifest.with_name("crops.json")], thesis, (0, 1), 2, 0.0, DETECTION, *files
    )
    assert tuple(pd.read_csv(files[0]).columns) == COLUMNS == tuple(both.columns)
    times = pd.read_csv(files[1])
    assert list(times.columns) == ["model", "seed", "fold", "training_seconds"]
    assert list(times["fold"]) == [1, 2, 3, 1, 2, 3] and (times["training_seconds"] > 0).all()
    of_towers = both["voxels"] == WHOLE_TOWERS
    table, whole = both[~of_towers], both[of_towers]
    assert set(both["model"]) == {thesis.name}
    assert set(table["voxels"]) == {AT_TAU}
    dataset = load([manifest])
    names = sorted(sample.id for sample in dataset.samples)
    assert list(table["seed"]) == [0, 0, 0, 1, 1, 1]
    assert list(table["crops"][:3]) == [" ".join(names[i : i + 2]) for i in (0, 2, 4)]
    assert set(table["training_crops"]) == {4}
    by_id = {sample.id: sample for sample in dataset.samples}
    training, out = [by_id[n] for n in names[:2] + names[4:]], [by_id[n] for n in names[2:4]]
    tuned = train_and_tune(thesis, training, [], 1)
    row = table[(table["seed"] == 1) & (table["fold"] == 2)].iloc[0]
    counts = tuned.score(out)
    assert (row["tau"], row["f05"], row["tp"]) == (tuned.tau, counts.f05, counts.tp)
    assert row["tp"] + row["fn"] == sum(int(sample.labelled.sum()) for sample in out)
    row = whole[(whole["seed"] == 1) & (whole["fold"] == 2)].iloc[0]
    clouds = CropClouds([manifest.with_name("crops.json")])
    rules = rules_on(clouds, tuned.predict, tuned.tau, tuned.voxel_size, DETECTION)
    answers = {sample.id: rules(sample) for sample in out}
    counts = tuned.score_towers(out, answers)
    assert (row["tau"], row["f05"], row["tp"]) == (tuned.tau, counts.f05, counts.tp)
    against_truth = [replace(sample, labelled=sample.true) for sample in out]
    counts = tuned.score_towers(against_truth, answers)
    assert (row["truth_f05"], row["truth_tp"]) == (counts.f05, counts.tp)
    row = table[(table["seed"] == 1) & (table["fold"] == 2)].iloc[0]
    counts = tuned.score(against_truth)
    assert (row["truth_f05"], row["truth_tp"]) == (counts.f05, counts.tp)
    assert row["truth_tp"] + row["truth_fn"] == sum(int(sample.true.sum()) for sample in out)
    assert row["truth_tp"] + row["truth_fn"] < row["tp"] + row["fn"]


def test_only_crops_with_a_known_truth_are_scored_against_it(manifest, models):
    dataset = load([manifest])
    some = [replace(s, true=s.true if n else None) for n, s in enumerate(dataset.samples)]
    rows = rows_of(manifest, replace(dataset, samples=some), models[1], 2)
    first = next(row for row in rows if row["voxels"] == AT_TAU and row["fold"] == 1)
    assert first["truth_tp"] + first["truth_fn"] == some[1].true.sum()
    none = [replace(sample, true=None) for sample in some]
    for row in rows_of(manifest, replace(dataset, samples=none), models[1], 2):
        assert row["truth_f05"] is None and row["truth_tp"] is None
        assert row["f05"] is not None


def test_the_boosted_trees_take_part(manifest):
    (row, *_) = rows_of(manifest, load([manifest]), None, 3)
    assert row["model"] == "boosted trees"
    assert row["training_crops"] == 3
    assert 0 < row["tau"] < 1


def runs() -> pd.DataFrame:
    """Two seeds and two folds with counts that can be calculated by hand."""
    rows = []
    for seed, fold, tp, fp, fn, f05 in [(0, 1, 8, 2, 10, 0.6), (0, 2, 2, 0, 2, 0.8),
                                        (1, 1, 6, 4, 12, 0.4), (1, 2, 0, 0, 4, 0.0)]:  # fmt: skip
        row = dict.fromkeys(COLUMNS, 1.0) | {"model": "m", "seed": seed, "fold": fold, "f05": f05}
        row |= {"crops": "a b" if fold == 1 else "c", "alive": tp > 0}
        row |= {"tp": tp, "fp": fp, "fn": fn, "tn": 1000}
        # Against the truth, the second fold is not known.
        row |= {f"truth_{name}": None for name in (*SCORES, "tp", "fp", "fn", "tn")}
        if fold == 1:
            row |= {"truth_f05": f05 / 2, "truth_tp": tp / 2, "truth_fp": fp + tp / 2,
                    "truth_fn": 0, "truth_tn": 1000}  # fmt: skip
        rows.append(row)
    return pd.DataFrame(rows)


def test_means_over_folds_their_spread_over_seeds_and_pooled_counts():
    (row,) = summarise_folds(runs()).to_dict("records")
    assert (row["n_seeds"], row["n_folds"], row["crops"], row["live_share"]) == (2, 2, 3, 0.75)
    assert row["f05"] == pytest.approx(0.45)  # 0.7 and 0.2
    assert row["f05_std"] == pytest.approx(np.std([0.7, 0.2], ddof=1))
    # Seed 0: 10 of 12 detected and of 22 true; seed 1: 6 of 10 and of 22.
    f05 = [1.25 * 10 / (1.25 * 10 + 0.25 * 12 + 2), 1.25 * 6 / (1.25 * 6 + 0.25 * 16 + 4)]
    assert row["pooled_f05"] == pytest.approx(np.mean(f05))
    assert row["pooled_precision"] == pytest.approx((10 / 12 + 0.6) / 2)
    assert (row["worst_fold_f05"], row["best_fold_f05"]) == (0.4, 0.5)


def test_scores_against_the_truth_are_those_of_the_folds_whose_truth_is_known():
    table = summarise_folds(runs())
    (row,) = table.to_dict("records")
    assert row["truth_f05"] == pytest.approx(0.25)  # 0.3 and 0.2
    # Seed 0: 4 of 10 detected are true; seed 1: 3 of 10.
    assert row["truth_pooled_precision"] == pytest.approx((0.4 + 0.3) / 2)
    assert row["truth_pooled_recall"] == 1.0
    assert ranking(table, {}) == (
        "F0.5 of the tower class against the truth, best first: m, 1.0 0.250."
    )
    labels = runs().assign(**{f"truth_{name}": None for name in (*SCORES, "tp", "fp", "fn", "tn")})
    without = summarise_folds(labels)
    assert without.filter(like="truth_").isna().all(axis=None)
    assert ranking(without, {}) == "F0.5 of the tower class, best first: m, 1.0 0.450."


def test_one_seed_has_no_spread():
    table = summarise_folds(runs()[lambda t: t["seed"] == 0])
    assert pd.isna(table["f05_std"].iloc[0])


def test_the_folds_of_the_real_crops_are_those_of_docs_accuracy(real_data, tmp_path):
    folder = real_data / "ts40k"
    towers = survey_towers(folder, "edp", TowerSettings()).towers
    facts = cut_crops(
        "ts40k", folder, "edp", towers, CropSettings(), tmp_path / "c.zarr.zip", tmp_path / "c.json"
    )
    crops = [crop_of(entry) for entry in facts["crops"]]
    made = folds(crops, 2, neighbour=100)
    names = [[crops[i].id.removeprefix("ts40k-sample_") for i in fold.out] for fold in made]
    assert names == [["575", "578"], ["584", "588"], ["591", "593"]]
    assert all(len(fold.train) == 4 for fold in made)
