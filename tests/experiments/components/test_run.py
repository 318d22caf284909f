"""Rules alone, models alone, and both, each scored on crops that nothing was chosen on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from scenenet.dataset.crops import CropSettings, Truth, cut_crops
from scenenet.dataset.labelled_towers import TowerSettings, survey_towers
from scenenet.dataset.voxel_cache import build
from scenenet.dataset.voxels import VoxelSettings
from scenenet.detection.settings import DetectionSettings
from scenenet.experiments.components.run import (
    COLUMNS,
    Plan,
    score_model,
    score_untrained,
    write,
)
from scenenet.experiments.components.settings import (
    HIGH,
    ITS_OWN,
    NOTHING,
    PUBLISHED,
    RANDOM,
    RULES_ALONE,
    SHAPE_PRIORS,
    WITH,
    WITHOUT,
)
from scenenet.experiments.components.sources import from_file, trained, untrained
from scenenet.experiments.components.summary import summarise_components, who_does_the_work
from scenenet.experiments.label_noise.settings import LABELS
from scenenet.models.model_file import write_model
from scenenet.synthetic import SyntheticSettings, make_survey

DETECTION = DetectionSettings()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Crops, voxels and split of a synthetic line with its truth."""
    folder = tmp_path_factory.mktemp("components")
    line = SyntheticSettings(towers=6, seed=4, density=12, tower_density=24)
    survey, truth = folder / "line.laz", folder / "line.truth.laz"
    make_survey(line, survey, truth=truth)
    towers, true = (survey_towers(path, "edp", TowerSettings()).towers for path in (survey, truth))
    cut_crops("line", survey, "edp", towers, CropSettings(), folder / "crops.zarr.zip",
              folder / "crops.json", Truth(truth, true))  # fmt: skip
    grid = VoxelSettings(resolution=32)
    build(folder / "crops.json", grid, folder / "voxels.zarr.zip", folder / "voxels.json")
    parts = ["train", "train", "validation", "test", "test", "test"]
    rows = [f"line,line-{n:04d},{part}" for n, part in enumerate(parts, start=1)]
    (folder / "split.csv").write_text("\n".join(["survey,crop,part", *rows]))
    return folder


def parts_of(folder, leave_out=0):
    plan = Plan(leave_out, 0.0, folder / "split.csv")
    return plan.parts([folder / "voxels.json"], [folder / "crops.json"])


def test_the_parts_are_those_of_the_split_or_the_folds(folder):
    (part,) = parts_of(folder)
    assert [crop.crop.id for crop in part.tested] == ["line-0004", "line-0005", "line-0006"]
    assert [sample.id for sample in part.known.training] == ["line-0001", "line-0002"]
    assert [sample.id for sample in part.known.validation] == ["line-0003"]
    assert all(len(crop.cloud) == crop.sample.count.sum() for crop in part.tested)
    folds = parts_of(folder, leave_out=2)
    assert [[crop.crop.id for crop in fold.tested] for fold in folds] == [
        ["line-0001", "line-0002"],
        ["line-0003", "line-0004"],
        ["line-0005", "line-0006"],
    ]
    assert all(len(f.known.training) == 4 and not f.known.validation for f in folds)


@pytest.fixture(scope="module")
def fixed(folder, models) -> pd.DataFrame:
    """The rows of what is not trained, on the test part."""
    files = folder / "runs.csv", folder / "times.csv"
    write(score_untrained(parts_of(folder), models[0], (0, 1), DETECTION), *files)
    return pd.read_csv(files[0])


def test_answers_that_need_no_training(fixed):
    assert tuple(fixed.columns) == COLUMNS
    names = [NOTHING, HIGH, LABELS, SHAPE_PRIORS, RULES_ALONE]
    names += [PUBLISHED, PUBLISHED, RANDOM, RANDOM, RANDOM, RANDOM]
    assert list(fixed["model"]) == names
    assert list(fixed["rules"]) == [ITS_OWN] * 4 + [WITH] + [WITHOUT, WITH] * 3
    assert list(fixed["seed"]) == [0] * 7 + [0, 0, 1, 1]
    row = fixed.set_index(["model", "rules", "seed"])
    nothing = row.loc[(NOTHING, ITS_OWN, 0)]
    assert (nothing["truth_point_recall"], nothing["truth_towers_found"]) == (0, 0)
    assert nothing["truth_towers"] == 3
    high = row.loc[(HIGH, ITS_OWN, 0)]
    assert high["truth_point_recall"] > 0.7 and high["truth_point_precision"] < 0.5
    assert np.isnan(high["towers_found"])
    labels = row.loc[(LABELS, ITS_OWN, 0)]
    assert np.isnan(labels["point_f05"]) and np.isnan(labels["towers_found"])
    assert labels["truth_point_recall"] == 1 and 0.1 < labels["truth_point_precision"] < 1
    assert labels["truth_voxel_tp"] > 0
    alone = row.loc[(RULES_ALONE, WITH, 0)]
    assert alone["truth_towers_found"] >= 2 and alone["truth_point_f05"] > 0.6


def test_counts_are_of_all_test_crops(folder, fixed):
    (part,) = parts_of(folder)
    true = sum(int(crop.cloud.is_true_tower.sum()) for crop in part.tested)
    labelled = sum(int(crop.sample.labelled.sum()) for crop in part.tested)
    assert (fixed["truth_point_tp"] + fixed["truth_point_fn"] == true).all()
    of_models = fixed[fixed["model"] != LABELS]
    assert (of_models["voxel_tp"] + of_models["voxel_fn"] == labelled).all()


def test_without_truth_there_are_no_scores_against_it(folder, models):
    (part,) = parts_of(folder)
    bare = [
        replace(
            crop,
            crop=replace(crop.crop, true_towers=None),
            cloud=replace(crop.cloud, truth=None),
            sample=replace(crop.sample, true=None),
        )
        for crop in part.tested[:1]
    ]
    rows = list(score_untrained([replace(part, tested=bare)], models[0], (), DETECTION))
    assert (
        {row["truth_point_tp"] for row in rows} == {row["truth_towers"] for row in rows} == {None}
    )
    assert rows[0]["towers"] == 1


def test_a_model_is_scored_with_and_without_rules(folder, models):
    parts = parts_of(folder, leave_out=3)
    rows = list(score_model(parts, models[0], [], (0, 1), DETECTION))
    cases = [(row["seed"], row["fold"], row["rules"]) for row in rows]
    assert cases == [(s, f, r) for s in (0, 1) for f in (1, 2) for r in (WITHOUT, WITH)]
    source = trained(models[0], parts[1].known, 1)
    assert (rows[-1]["tau"], rows[-1]["parameters"]) == (source.tau, 11)
    assert all(row["training_seconds"] > 0 for row in rows)
    assert all(row["truth_towers"] == 3 for row in rows)


def test_the_boosted_trees_take_part(folder):
    rows = list(score_model(parts_of(folder), None, [], (0,), DETECTION))
    assert [row["model"] for row in rows] == ["boosted trees"] * 2
    assert rows[0]["voxel_tp"] > 0 and rows[1]["truth_point_tp"] > 0


def test_a_model_of_the_workflow_is_used_as_it_is(folder, pole_finder, tmp_path):
    write_model(tmp_path / "model.json", *pole_finder)
    model, card = pole_finder
    source = from_file(tmp_path / "model.json", 7)
    assert (source.name, source.seed, source.tau) == ("by-hand", 7, card.tau)
    assert source.voxel_size == card.voxel_size and source.parameters == model.n_parameters()
    (part,) = parts_of(folder)
    few = replace(part, tested=part.tested[:1])
    settings = None  # is not asked
    rows = list(score_model([few], settings, [tmp_path / "model.json"], (7,), DETECTION))
    assert [(row["model"], row["seed"]) for row in rows] == [("by-hand", 7)] * 2


def test_random_models_have_the_tau_of_known_crops(folder, models):
    (part,) = parts_of(folder)
    alone, published, *drawn = untrained(models[0], part.known, (0, 1))
    assert alone.voxel_size == pytest.approx(part.known.voxel_size)
    assert [source.seed for source in drawn] == [0, 1]
    probability = [source.predict(part.tested[0].sample)[0] for source in drawn]
    assert not np.array_equal(*probability)
    assert published.parameters == 11
    for source in (published, *drawn):
        assert 0 < source.tau <= 1


def runs() -> pd.DataFrame:
    """Two seeds and two folds, with counts that can be calculated by hand."""
    rows = []
    for model, rules, seed, fold, tp, fp, fn, false in [
        (RULES_ALONE, WITH, 0, 1, 5, 5, 5, 2), (RULES_ALONE, WITH, 0, 2, 5, 5, 5, 0),
        ("net", WITH, 0, 1, 8, 0, 2, 0), ("net", WITH, 0, 2, 8, 0, 2, 0),
        ("net", WITH, 1, 1, 8, 2, 2, 1), ("net", WITH, 1, 2, 0, 0, 10, 0),
        ("cnn", WITH, 0, 1, 1, 0, 1, 0), ("cnn", WITH, 0, 2, 1, 0, 1, 0),
    ]:  # fmt: skip
        row = dict.fromkeys(COLUMNS) | {"model": model, "rules": rules, "seed": seed, "fold": fold}
        row |= {"crops": "a b" if fold == 1 else "c", "alive": tp > 0, "parameters": 11}
        for what in ("point", "voxel"):
            row |= {f"{what}_tp": tp, f"{what}_fp": fp, f"{what}_fn": fn}
        row |= {"towers": 2, "towers_found": tp // 4, "towers_false": false}
        rows.append(row)
    return pd.DataFrame(rows)


def test_mean_and_worst_over_seeds_of_the_counts_of_all_folds():
    table = summarise_components(runs()).set_index("model")
    net = table.loc["net"]
    assert (net["n_seeds"], net["crops"], net["live_share"]) == (2, 3, 0.75)
    # Seed 0: 16 of 16 detected and of 20 true; seed 1: 8 of 10 and of 20.
    f05 = [1.25 * 16 / (1.25 * 16 + 0.25 * 4), 1.25 * 8 / (1.25 * 8 + 0.25 * 12 + 2)]
    assert net["point_f05"] == pytest.approx(np.mean(f05))
    assert net["point_f05_worst"] == pytest.approx(f05[1])
    assert net["point_precision_worst"] == pytest.approx(0.8)
    assert (net["towers"], net["towers_found"], net["towers_found_worst"]) == (4, 3, 2)
    assert (net["towers_false"], net["towers_false_worst"]) == (0.5, 1)
    assert table.filter(like="truth_").isna().all(axis=None)


def test_what_a_model_adds_to_the_rules_is_said_by_a_rule():
    table = summarise_components(runs())
    kinds = {"net": "scenenet", "cnn": "cnn"}
    assert who_does_the_work(table, kinds) == (
        "F0.5 of points against the labels: rules alone 0.50; net with rules 0.81 (worst seed "
        "0.67). net adds to the rules (+0.31)."
    )
    better = runs().replace({"point_fp": {5: 0}, "point_fn": {5: 1}})
    text = who_does_the_work(summarise_components(better), kinds)
    assert text.endswith("net adds little to the rules (-0.15).")
