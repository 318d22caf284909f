"""Tables have the numbers of the result files and of the thesis."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from fixtures.result_folder import with_observer, with_truth

from scenenet.core.errors import InputError
from scenenet.evaluation.result import Scores
from scenenet.experiments.published import Thesis, read_thesis
from scenenet.experiments.studies.settings import StudySettings
from scenenet.metrics.score_columns import AT_TAU, SCORES, WHOLE_TOWERS
from scenenet.models.model_file import read_model
from scenenet.results import tables
from scenenet.results.claims.table import write_claims
from scenenet.results.folder import Results
from scenenet.results.published_numbers import write_published_numbers
from scenenet.results.score_tables import TRIVIAL
from scenenet.results.time_tables import experiment_times


def row(frame: pd.DataFrame, **where) -> pd.Series:
    for name, value in where.items():
        frame = frame[frame[name] == value]
    assert len(frame) == 1
    return frame.iloc[0]


def test_class_shares_are_those_of_all_points_with_those_of_table_5_1(
    results: Results, thesis: Thesis
):
    found = tables.classes(results, thesis)
    tower = row(found, code=15)
    assert tower["share_percent"] == pytest.approx(10.0)
    assert tower["thesis_percent"] == pytest.approx(0.519)
    assert found["share_percent"].sum() == pytest.approx(100)
    assert found["thesis_percent"].sum() == pytest.approx(100, abs=0.01)
    assert list(found["code"]) == list(range(22))


def test_class_shares_of_two_surveys_are_weighted_by_their_points(results: Results, thesis: Thesis):
    south = results.folder / "check" / "south" / "classes.csv"
    south.parent.mkdir()
    south.write_text("code,class,points,share_percent\n15,Power line support tower,10000,100\n")
    both = replace(results, surveys=["north", "south"])
    tower = row(tables.classes(both, thesis), code=15)
    assert tower["share_percent"] == pytest.approx(100 * 11_000 / 20_000)
    assert (tower["lowest_percent"], tower["highest_percent"]) == pytest.approx((10, 100))


def test_tower_properties_leave_out_the_missing_last_spacing(results: Results, thesis: Thesis):
    found = tables.towers(results, thesis)
    spacing = row(found, property="spacing")
    assert (spacing["towers"], spacing["mean"]) == (2, 300)
    height = row(found, property="height")
    assert (height["mean"], height["lowest"], height["highest"]) == (30, 20, 40)
    assert (height["thesis_mean"], height["thesis_lowest"]) == (34.74, 18)


def test_voxelisation_time_is_the_mean_over_crops(results: Results, thesis: Thesis):
    found = row(tables.voxelisation(results, thesis), grid="cube-64")
    assert found["seconds"] == pytest.approx(0.2)
    assert found["thesis_seconds"] == 0.45
    assert found["tower_share_percent"] == pytest.approx(2.5)


def test_models_have_mean_and_spread_over_seeds(results: Results, thesis: Thesis):
    found = row(tables.models(results, thesis), model="scenenet", counted="all seeds")
    assert found["precision"] == pytest.approx(0.7)
    assert found["precision_std"] == pytest.approx(0.1 * math.sqrt(2))
    assert (found["parameters"], found["live_share"], found["n_seeds"]) == (11, 1, 2)
    assert (found["thesis_precision"], found["thesis_precision_std"]) == (0.68, 0.08)


def test_dead_seeds_count_and_live_seeds_have_their_own_row(results: Results, thesis: Thesis):
    found = tables.models(results, thesis)
    every = row(found, model="cnn", counted="all seeds")
    live = row(found, model="cnn", counted="live seeds")
    assert every["precision"] == pytest.approx(0.2)
    assert every["live_share"] == 0.5
    assert live["precision"] == pytest.approx(0.4)
    assert (live["n_seeds"], every["parameters"]) == (1, 2190)
    assert math.isnan(live["precision_std"])
    assert "live seeds" not in set(found.loc[found["model"] == "scenenet", "counted"])


def test_the_trivial_baseline_has_its_own_row(results: Results, thesis: Thesis):
    trivial = row(tables.models(results, thesis), model=TRIVIAL)
    assert trivial["miou"] == pytest.approx(0.499)
    assert trivial["precision"] == 0


def test_the_seed_that_predicts_is_the_best_on_validation(results: Results, thesis: Thesis):
    found = tables.models(results, thesis)
    best = found[found["counted"].str.contains("best on validation")]
    assert list(best["counted"]) == ["seed 0, best on validation"] * 2
    assert best.iloc[0]["precision"] == pytest.approx(0.8)


def test_each_seed_has_a_row(results: Results, thesis: Thesis):
    found = tables.seeds(results, thesis)
    assert len(found) == 4
    dead = row(found, model="cnn", seed=1)
    assert not dead["alive"]
    assert dead["epochs"] == 4
    times = row(tables.TABLES["seed_times"].make(results, thesis), model="cnn", seed=1)
    assert (times["epochs"], times["training_seconds"], times["peak_memory_mb"]) == (4, 8, 501)


def test_position_errors_are_those_of_seeds_that_hit_something(results: Results, thesis: Thesis):
    found = row(tables.tower_scores(results, thesis), model="cnn", counted="all seeds")
    assert found["median_error_m"] == 1.5


def test_scores_against_the_truth_have_columns_of_their_own(results: Results, thesis: Thesis):
    """The truth is known for one of two seeds of one model, and nothing is tower in it twice."""
    path = results.folder / "evaluate" / "scenenet" / "seed-1.json"
    record = json.loads(path.read_text())
    points = {"precision": 0.5, "recall": None, "iou": 0.25, "n_true": 0, "n_predicted": 9}
    points["n_points"] = 90
    truth = {name: record[name] for name in Scores.__dataclass_fields__}
    truth |= {
        "voxel": record["voxel"] | {"f05": 0.125},
        "towers": record["towers"] | {"median_base_error_m": 2.5},
        "points": points,
    }
    record |= {"truth": truth, "labels_against_truth": points | {"precision": 0.75}}
    path.write_text(json.dumps(record))
    fresh = replace(results)
    found = tables.models(fresh, thesis)
    assert row(found, model="scenenet", counted="all seeds")["truth_f05"] == 0.125
    assert row(found, model="scenenet", counted="all seeds")["f05"] == pytest.approx(0.35)
    assert found.loc[found["model"] == "cnn", "truth_f05"].isna().all()
    columns = list(found.columns)
    assert columns.index("truth_precision") < columns.index("precision")
    towers = row(tables.tower_scores(fresh, thesis), model="scenenet", counted="all seeds")
    assert (towers["truth_median_base_error_m"], towers["median_height_error_m"]) == (2.5, 0.7)
    of_points = tables.point_scores(fresh, thesis)
    model = row(of_points, model="scenenet", counted="all seeds")
    assert (model["truth_precision"], model["truth_n_predicted"]) == (0.5, 9)
    assert math.isnan(model["truth_recall"]) and math.isnan(model["precision"])
    labels = of_points.iloc[-1]
    assert (labels["model"], labels["truth_precision"]) == ("the labels", 0.75)
    seeds = tables.seeds(fresh)
    known = row(seeds, model="scenenet", seed=1)
    assert (known["truth_f05"], known["truth_point_iou"]) == (0.125, 0.25)
    assert known["truth_average_precision"] == known["average_precision"]
    assert seeds["truth_f05"].notna().sum() == 1


def test_an_observer_has_a_row_of_its_own_and_none_among_the_models(
    results: Results, thesis: Thesis
):
    assert tables.observers(results, thesis).empty
    found = with_observer(results)
    row, trees, trivial = tables.observers(found, thesis).to_dict("records")
    assert (row["observer"], row["target"], row["seed"]) == ("wires", "wire", 0)
    scores = found.seed("scenenet", 0).evaluation
    assert row["voxel_iou_tower"] == scores.voxel.iou_tower
    assert row["squares"] == scores.voxel.n_samples
    assert row["parameters"] == read_model(found.folder / "models/wires.json")[0].n_parameters()
    assert (trees["observer"], trees["model"], trees["parameters"]) == (
        "wires", "boosted trees", 3000
    )  # fmt: skip
    assert (trivial["observer"], trivial["model"]) == ("wires", "every point")
    assert not {"wires", "boosted trees"} & set(tables.models(found, thesis)["model"])


def test_an_observer_stands_beside_the_answer_that_every_point_is_the_target(
    results: Results, thesis: Thesis
):
    table = tables.observers(with_truth(with_observer(results)), thesis)
    trivial = row(table, model="every point")
    assert (trivial["truth_point_recall"], trivial["truth_point_iou"]) == (1, 0.1)
    assert trivial["point_n_predicted"] == 700 and trivial["truth_point_precision"] == 0.1
    assert math.isnan(trivial["voxel_iou_tower"])


def test_an_observer_without_boosted_trees_has_its_row(results: Results, thesis: Thesis):
    found = with_observer(results)
    (results.folder / "boosted_trees/wires/seed-0.json").unlink()
    assert list(tables.observers(found, thesis)["model"]) == ["scenenet", "every point"]


def test_training_time_is_the_sum_of_the_epochs(results: Results, thesis: Thesis):
    found = row(tables.times(results, thesis), model="scenenet")
    assert (found["training_seconds"], found["seconds_per_epoch"]) == (8, 2)
    assert found["thesis_training_seconds"] == 85 * 60


def test_time_until_a_useful_model_counts_the_dead_ones(results: Results, thesis: Thesis):
    found = row(tables.times(results, thesis), model="cnn")
    assert (found["live_share"], found["useful_seconds"]) == (0.5, 16)
    assert (found["thesis_useful_seconds"], found["thesis_inference_ms"]) == (8 * 3600, 43)


def test_inference_and_memory_are_as_measured(results: Results, thesis: Thesis):
    found = tables.times(results, thesis)
    scenenet, cnn = row(found, model="scenenet"), row(found, model="cnn")
    assert (scenenet["inference_ms"], scenenet["inference_ms_128"]) == (8, 50)
    assert (cnn["inference_ms"], scenenet["peak_memory_mb"]) == (12, 501)
    assert math.isnan(cnn["inference_ms_128"])


def test_the_boosted_trees_are_timed(results: Results, thesis: Thesis):
    folder = results.folder / "boosted_trees"
    folder.mkdir()
    evaluation = (results.folder / "evaluate" / "scenenet" / "seed-0.json").read_text()
    for seed in results.seeds:
        (folder / f"seed-{seed}.json").write_text(evaluation)
    times = {"training_seconds": [3, 5], "inference_ms": {"64": 30}, "peak_memory_mb": 900}
    (folder / "times.json").write_text(json.dumps(times))
    found = row(tables.times(results, thesis), model="boosted trees")
    assert (found["training_seconds"], found["useful_seconds"]) == (4, 4)
    assert (found["inference_ms"], found["peak_memory_mb"]) == (30, 900)


def test_parameters_are_in_metres_with_initial_and_published_values(
    results: Results, thesis: Thesis, growth: float
):
    found = tables.parameters(results, thesis)
    assert len(found) == 12
    assert set(found["model"]) == {"scenenet"}
    drawn = [read_model(r.model_files[0])[0].shape_parameters() for r in results.trained
             if r.kind == "scenenet"]  # fmt: skip
    for name, factor, unit in (("cylinder.r", 1.3, "m"), ("arrow.sigma", 1.3**2, "m^2"),
                               ("negative_sphere.omega", 1, "1")):  # fmt: skip
        values = [factor * numbers[name] for numbers in drawn]
        entry = row(found, parameter=name)
        assert entry["mean"] == pytest.approx(sum(values) / 2)
        assert entry["std"] == pytest.approx(abs(values[0] - values[1]) / math.sqrt(2))
        assert entry["initial"] == pytest.approx(entry["mean"] / growth, rel=1e-4)
        assert entry["unit"] == unit
        assert len(entry["sentence"]) > 20
    share = row(found, parameter="lambda.negative_sphere")
    assert share["thesis"] == pytest.approx(0.7634)
    weights = found[found["symbol"] == "λ"]
    assert weights["mean"].sum() == pytest.approx(1, abs=1e-5)


def test_each_verified_property_of_each_model_has_a_row(results: Results, thesis: Thesis):
    found = tables.certificate(results, thesis)
    counts = found["model"].value_counts()
    assert (counts["scenenet"], counts["cnn"]) == (8, 2)
    convex = row(found, model="scenenet", property="convex combination of GENEOs")
    assert convex["value"] == pytest.approx(1, abs=1e-5)
    assert "cylinder" in convex["found"]
    moved = tables.turns(results, thesis)
    straight = row(moved, model="scenenet", degrees=0)
    assert straight["mean_h"] == 0
    assert moved["degrees"].isna().sum() == 2


def test_every_table_is_written_and_reads_back(results: Results, thesis: Thesis, tmp_path: Path):
    made = with_a_timed_study(with_observer(results))
    paths = tables.write_tables(made, thesis, tmp_path / "tables")
    assert {path.stem for path in paths} == set(tables.TABLES)
    for path in paths:
        assert len(pd.read_csv(path)) > 0, path.name


def test_stages_that_did_not_run_leave_columns_without_rows(thesis: Thesis, tmp_path: Path):
    empty = Results(tmp_path, models={"scenenet": "scenenet"}, seeds=[0], surveys=["north"])
    for path in tables.write_tables(empty, thesis, tmp_path / "tables"):
        read = pd.read_csv(path)
        assert len(read) == 0
        assert len(read.columns) > 3


def test_a_broken_result_is_named(results: Results, thesis: Thesis):
    broken = results.folder / "evaluate" / "cnn" / "seed-0.json"
    broken.write_text("{")
    with pytest.raises(InputError, match=r"evaluate/cnn/seed-0\.json: is not JSON"):
        tables.seeds(results, thesis)


def test_published_numbers_have_a_place_and_a_value_or_a_bound(thesis: Thesis):
    assert len(thesis.numbers) > 90
    for name, number in thesis.numbers.items():
        known = (number.value, number.low, number.high)
        assert number.place, name
        assert any(part is not None for part in known), name


def test_a_misspelt_published_number_is_named(tmp_path: Path):
    file = tmp_path / "thesis.yaml"
    file.write_text("source: s\nnumbers:\n  a.b: {valu: 1, place: p}\n")
    with pytest.raises(InputError, match=r"numbers\.a\.b\.valu"):
        read_thesis(file)


def test_the_boosted_trees_have_a_row(results: Results, thesis: Thesis):
    source = results.folder / "evaluate" / "scenenet" / "seed-0.json"
    entry = json.loads(source.read_text()) | {"parameters": 1000}
    for seed, precision in ((0, 0.9), (1, 0.7)):
        entry["voxel"] = entry["voxel"] | {"precision": precision}
        out = results.folder / "boosted_trees" / f"seed-{seed}.json"
        out.parent.mkdir(exist_ok=True)
        out.write_text(json.dumps(entry))
    found = row(tables.models(results, thesis), model="boosted trees")
    assert found["precision"] == pytest.approx(0.8)
    assert (found["parameters"], found["n_seeds"]) == (1000, 2)


def test_both_ways_to_count_are_in_one_row(results: Results, thesis: Thesis):
    for seed in results.seeds:
        path = results.folder / "evaluate" / "scenenet" / f"seed-{seed}.json"
        record = json.loads(path.read_text())
        record["voxel_towers"] = {**record["voxel_towers"], "f05": 0.5 + 0.1 * seed}
        record["whole_towers"] = True
        record["voxel"] = record["voxel_towers"]
        path.write_text(json.dumps(record))
    fresh = replace(results)
    table = tables.whole_towers(fresh).set_index("model")
    expected = np.mean([0.5 + 0.1 * seed for seed in results.seeds])
    assert table.loc["scenenet", "towers_f05"] == pytest.approx(expected)
    seeds = tables.seeds(fresh)
    by_observer = [r.evaluation.voxel_observer.f05 for r in fresh.of_model("scenenet")]
    assert table.loc["scenenet", "tau_f05"] == pytest.approx(np.mean(by_observer))
    models = tables.models(fresh, thesis).set_index("model")
    assert set(models.loc["scenenet", "voxels"]) == {WHOLE_TOWERS}
    assert set(np.atleast_1d(models.loc["cnn", "voxels"])) == {AT_TAU}
    assert seeds[seeds["model"] == "scenenet"]["f05"].mean() == pytest.approx(expected)


def test_two_runs_that_differ_in_their_times_have_the_same_digest_of_scores(
    results: Results, thesis: Thesis, tmp_path: Path
):
    def digest_of(folder: str) -> dict:
        written = tables.write_tables(replace(results), thesis, tmp_path / folder)
        comparisons = [tmp_path / folder / f"{name}.csv" for name in tables.COMPARISONS]
        write_claims(replace(results), thesis, *comparisons[:2])
        write_published_numbers(replace(results), thesis, *comparisons[2:])
        return tables.digest_scores(
            tmp_path / folder, [path.stem for path in (*written, *comparisons)]
        )

    first = digest_of("first")
    for history in results.folder.glob("train/*/*/history.csv"):
        table = pd.read_csv(history)
        table.assign(seconds=3 * table["seconds"]).to_csv(history, index=False)
    for times in results.folder.glob("inference_time/*.json"):
        record = json.loads(times.read_text())
        record["inference_ms"] = {size: 3 * ms for size, ms in record["inference_ms"].items()}
        times.write_text(json.dumps(record))
    assert digest_of("slower") == first
    slower, before = (tmp_path / name / "times.csv" for name in ("slower", "first"))
    assert slower.read_bytes() != before.read_bytes()
    assert {"seeds", "models", "claims", "published_numbers"} <= set(first["tables"])
    timed = {"times", "seed_times", "claims_times", "published_numbers_times"}
    assert not timed & set(first["tables"])
    evaluation = results.folder / "evaluate" / "cnn" / "seed-0.json"
    record = json.loads(evaluation.read_text())
    record["voxel"]["precision"] += 0.01
    evaluation.write_text(json.dumps(record))
    assert digest_of("better")["digest"] != first["digest"]


def test_a_score_that_is_not_defined_is_empty_in_every_table_and_no_zero(
    results: Results, thesis: Thesis, tmp_path: Path
):
    """As for crops without a labelled tower in which none is found."""
    nothing = dict.fromkeys(SCORES)
    for path in results.folder.glob("evaluate/*/*.json"):
        record = json.loads(path.read_text())
        for part in [name for name in record if name.startswith("voxel")]:
            record[part] |= nothing
        record["towers"] |= {"precision": None, "recall": None, "n_true": 0, "n_predicted": 0}
        record["average_precision"] = None
        path.write_text(json.dumps(record))
    fresh = replace(results)
    tables.write_tables(fresh, thesis, tmp_path)
    for name, columns in {
        "seeds": [*SCORES, "average_precision", "tower_precision", "tower_recall"],
        "models": SCORES,
        "whole_towers": ["tau_precision", "towers_f05"],
        "tower_scores": ["precision", "recall"],
    }.items():
        table = pd.read_csv(tmp_path / f"{name}.csv")
        assert len(table) and table[list(columns)].isna().all(axis=None), name


def with_a_timed_study(results: Results) -> Results:
    """The results with the times of a study of two variants and two seeds."""
    study = StudySettings(name="s", title="t", place="5.3", asks="?", seeds=(0, 1),
                          variants=({"name": "A"}, {"name": "E"}))  # fmt: skip
    rows = [
        {"variant": v, "seed": s, "training_seconds": 2.0 + s, "inference_ms": 5.0}
        for v in "AE"
        for s in (0, 1)
    ]
    folder = results.folder / "study" / "s"
    folder.mkdir(parents=True)
    pd.DataFrame(rows).to_csv(folder / "times.csv", index=False)
    return replace(results, studies=[study])


def test_the_times_of_a_study_stand_in_a_table_of_their_own(results: Results):
    found = experiment_times(with_a_timed_study(results))
    a = row(found, case="A")
    assert (a["experiment"], a["n_trainings"], a["training_seconds"]) == ("s", 2, 2.5)
    assert (a["training_seconds_std"], a["inference_ms"]) == (pytest.approx(0.5**0.5), 5.0)


def test_the_table_of_the_dataset_counts_wrong_labels_and_measures_true_towers(
    results: Results, thesis: Thesis
):
    path = results.folder / "crops" / "north" / "manifest.json"
    manifest = json.loads(path.read_text())
    for entry, (labelled, wrong) in zip(
        manifest["crops"], ((100, 10), (300, 200), (0, 0)), strict=True
    ):
        entry |= {"labelled": labelled, "wrong": wrong}
    path.write_text(json.dumps(manifest))
    towers = pd.read_csv(results.folder / "towers" / "north" / "towers.csv")
    towers.assign(width=3.0).to_csv(results.folder / "towers/north/true_towers.csv", index=False)
    found = tables.TABLES["dataset"].make(results, thesis).set_index("property")
    assert found.loc["crops", "value"] == 3
    assert found.loc["crops", "thesis"] == 2823
    assert found.loc["wrong", "value"] == pytest.approx(100 * 210 / 400)
    assert found.loc["wrong", "counted"] == 400
    assert found.loc["true width", "value"] == 3.0
    assert found.loc["true height", "highest"] == 40.0
    assert found.loc["true spacing", "counted"] == 2


def test_without_known_truth_the_table_of_the_dataset_has_the_crops(
    results: Results, thesis: Thesis
):
    found = tables.TABLES["dataset"].make(results, thesis)
    assert list(found["property"]) == ["crops", "points of a crop"]
