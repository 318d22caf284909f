"""``scenenet evaluate``: scores of points, and scores against labels and truth."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from pathlib import Path

import laspy
import numpy as np
import pytest

from scenenet.models.model_file import write_model
from scenenet.pointcloud import PointCloud, read, write_las
from scenenet.synthetic import SyntheticSettings, make_survey

LABELLED = ("--codes", "edp", "--json")
LONE = (*LABELLED, "--min-conductor", "0")
"""Options for poles without conductors."""


@dataclass(frozen=True)
class Line:
    """A synthetic line: its survey, its truth, and a model."""

    survey: Path
    truth: Path
    model: Path


@pytest.fixture(scope="module")
def line(tmp_path_factory, pole_finder) -> Line:
    folder = tmp_path_factory.mktemp("line")
    made = Line(folder / "line.laz", folder / "line.truth.laz", folder / "by-hand.json")
    make_survey(SyntheticSettings(towers=3, seed=5, density=20), made.survey, truth=made.truth)
    write_model(made.model, *pole_finder)
    return made


@pytest.fixture(scope="module")
def scored(line) -> dict[str, dict]:
    """What ``evaluate --json`` prints for each fit."""
    import contextlib
    import io

    from scenenet.cli.app import main

    printed = {}
    for fit in ("cube", "metric"):
        with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.suppress(SystemExit):
            main(["evaluate", str(line.survey), "--truth", str(line.truth), "--model",
                  str(line.model), "--fit", fit, *LABELLED])  # fmt: skip
        printed[fit] = json.loads(out.getvalue())
    return printed


def shares(predicted: np.ndarray, true: np.ndarray) -> dict[str, float | int]:
    """The scores of points, counted here from two masks."""
    both = int((predicted & true).sum())
    return {
        "precision": both / predicted.sum(),
        "recall": both / true.sum(),
        "iou": both / (predicted | true).sum(),
        "n_true": int(true.sum()),
        "n_predicted": int(predicted.sum()),
        "n_points": len(true),
    }


def test_the_towers_come_first_and_no_row_of_voxels_is_there_twice(line, call):
    rows = call("evaluate", line.survey, "--model", line.model, "--codes", "edp").out.splitlines()
    assert rows[0].startswith("towers: ")
    voxels = [tuple(re.findall(r"-|\d\.\d{3}", row)) for row in rows[2:-3]]
    assert len(voxels) == len(set(voxels)) == 4, rows
    assert rows[-1].startswith("labels cover what stands around a tower too")


def test_with_the_line_points_of_conductors_count_as_wires(line, call, tmp_path):
    given = "evaluate", line.survey, "--model", "wires", *LABELLED, "--truth", line.truth
    alone, scores = (json.loads(call(*given, *more).out) for more in ((), ("--line",)))
    cloud = read(line.survey, "edp")
    write_las(tmp_path / "bare.laz", PointCloud(cloud.xyz, np.zeros_like(cloud.classification)))
    called = call("predict", tmp_path / "bare.laz", "--line", "--classify", "--codes", "edp",
                  "--out", tmp_path / "found", "--json")  # fmt: skip
    assert called.code == 0
    [summary] = json.loads(called.out)
    assert scores["points"]["n_predicted"] == summary["targets"][1]["points"]
    classified = np.asarray(laspy.read(tmp_path / "found" / "bare.laz").classification) == 16
    # Points of towers are of nothing else where classes are written.
    assert (
        0.9 * summary["targets"][1]["points"] < classified.sum() < summary["targets"][1]["points"]
    )
    assert scores["points"]["n_true"] == int((cloud.classification == 16).sum())
    assert scores["truth"]["points"]["iou"] > alone["truth"]["points"]["iou"]


def test_the_line_says_nothing_of_other_targets(line, call):
    refused = call("evaluate", line.survey, "--model", line.model, *LABELLED, "--line")
    assert refused.code == 2
    assert "needs a model of wire" in refused.err


def test_points_are_those_of_the_survey_that_predict_writes(line, scored, call, tmp_path):
    done = call("predict", line.survey, "--model", line.model, "--out", tmp_path)
    assert done.code == 0, done.err
    in_tower = np.asarray(laspy.read(tmp_path / "line.laz").tower_id) > 0
    labelled, true = read(line.survey, "edp").is_tower, read(line.truth, "edp").is_tower
    assert in_tower.sum() > 100
    for result in scored.values():
        assert result["points"] == shares(in_tower, labelled)
        assert result["truth"]["points"] == shares(in_tower, true)
        assert result["labels_against_truth"] == shares(labelled, true)
    assert result["labels_against_truth"]["recall"] == 1.0 > result["points"]["recall"]


def test_every_crop_has_its_points(line, scored):
    cloud = read(line.survey, "edp")
    for fit in ("cube", "metric"):
        rows = scored[fit]["per_sample"]
        assert [row["id"] for row in rows] == ["line-0001", "line-0002", "line-0003"]
        assert sum(row["points"]["n_true"] for row in rows) == cloud.is_tower.sum()
        against_truth = scored[fit]["truth"]["per_sample"]
        assert [row["id"] for row in against_truth] == [row["id"] for row in rows]
        assert all(0 < t["points"]["n_true"] < row["points"]["n_true"]
                   for t, row in zip(against_truth, rows, strict=True))  # fmt: skip


def test_voxels_and_towers_are_scored_against_the_truth_too(line, scored, call):
    """As if the truth were the labels, for the towers of the whole survey."""
    done = call("evaluate", line.truth, "--model", line.model, "--fit", "metric", *LABELLED)
    as_labels = json.loads(done.out)
    against = scored["metric"]["truth"]
    assert against["towers"] == as_labels["towers"]
    assert against["towers"]["n_true"] == 3
    assert against["points"] == as_labels["points"]
    # Annotators label more voxels than are tower, and all that are.
    labels, truth = (s["voxel_trivial"]["n_samples"] for s in (scored["metric"], against))
    assert labels == truth == 3
    for own, true in zip(scored["cube"]["per_sample"], scored["cube"]["truth"]["per_sample"],
                         strict=True):  # fmt: skip
        assert 0 < true["tp"] + true["fn"] < own["tp"] + own["fn"]
        assert true["tp"] + true["fp"] == own["tp"] + own["fp"]  # the same prediction


def test_without_truth_there_is_no_score_against_it(line, call):
    done = call("evaluate", line.survey, "--model", line.model, *LABELLED)
    result = json.loads(done.out)
    assert result["truth"] is None and result["labels_against_truth"] is None
    assert set(result["points"]) == {
        "precision", "recall", "iou", "n_true", "n_predicted", "n_points"
    }  # fmt: skip


def test_the_text_leads_with_the_truth_and_names_both(line, call):
    done = call(
        "evaluate", line.survey, "--truth", line.truth, "--model", line.model, *LABELLED[:-1]
    )
    lines = done.out.splitlines()
    assert lines[0] == "against the truth"
    labels = lines.index("against the labels")
    assert any(text.startswith("points: ") for text in lines[:labels])
    assert sum(text.startswith("the labels themselves: ") for text in lines[:labels]) == 1
    without = call("evaluate", line.survey, "--model", line.model, *LABELLED[:-1])
    assert without.out.splitlines() == lines[labels + 1 :]


def test_undefined_scores_of_points_are_null(call, pole_model, scene, tmp_path):
    """Ground without a tower, in the labels and in the prediction."""
    cloud = scene([], tree=None)
    write_las(tmp_path / "field.laz", cloud)
    done = call("evaluate", tmp_path / "field.laz", "--truth", tmp_path / "field.laz", "--model",
                pole_model, "--fit", "metric", *LONE)  # fmt: skip
    assert done.code == 0, done.err
    result = json.loads(done.out)
    nothing = {"precision": None, "recall": None, "iou": None, "n_true": 0, "n_predicted": 0}
    nothing["n_points"] = len(cloud.xyz)
    assert result["points"] == result["truth"]["points"] == nothing
    assert result["labels_against_truth"] == nothing
    assert result["truth"]["towers"]["n_true"] == result["truth"]["voxel"]["n_samples"] == 0


def test_false_towers_in_samples_without_a_tower_count(call, pole_model, scene, tmp_path):
    """The second sample has a pole that is labelled as an object."""
    for number, code in enumerate((15, 6)):
        cloud = scene(seed=number)
        codes = np.where(cloud.classification == 15, code, cloud.classification)
        np.save(tmp_path / f"{number}.npy", np.column_stack([cloud.xyz, codes]))
    done = call("evaluate", tmp_path, "--model", pole_model, "--fit", "metric", *LONE)
    result = json.loads(done.out)
    assert [row["id"] for row in result["per_sample"]] == [f"{tmp_path.name}-0"]
    assert (result["towers"]["n_true"], result["towers"]["n_predicted"]) == (1, 2)
    [sample] = result["per_sample"]
    assert result["points"]["n_true"] == sample["points"]["n_true"] == 280
    assert result["points"]["n_predicted"] > sample["points"]["n_predicted"] > 200


def test_heights_are_compared_with_the_ground_under_the_tower(call, pole_survey, pole_model):
    """A pole of 14 m on flat ground."""
    done = call("evaluate", pole_survey, "--model", pole_model, "--fit", "metric", *LONE)
    towers = json.loads(done.out)["towers"]
    assert towers["median_height_error_m"] < 1.5 and towers["median_base_error_m"] < 1.5
    in_crops = json.loads(call("evaluate", pole_survey, "--model", pole_model, *LONE).out)["towers"]
    assert 0 < in_crops["median_height_error_m"] < 2.5


def test_the_number_of_truths_must_be_that_of_the_labelled_files(call, line):
    done = call("evaluate", line.survey, line.survey, "--truth", line.truth, "--model", line.model,
                "--codes", "edp")  # fmt: skip
    assert done.code == 2
    assert "--truth" in done.err and "1 for 2 labelled files" in done.err


@pytest.mark.parametrize("fault", ["fewer points", "moved point", "folder", "missing"])
def test_a_file_with_other_points_is_no_truth(call, pole_survey, pole_model, tmp_path, fault):
    cloud, truth = read(pole_survey), tmp_path / "truth.laz"
    xyz, kept = cloud.xyz.copy(), slice(None)
    if fault == "fewer points":
        kept = slice(1, None)
    xyz[41] += [0, 0, 0.5]
    if fault == "folder":
        truth = tmp_path
    elif fault != "missing":
        write_las(truth, PointCloud(xyz[kept], cloud.classification[kept]))
    good = tmp_path / "good.laz"
    write_las(good, cloud)
    done = call("evaluate", pole_survey, good, "--truth", truth, "--truth", good, "--model",
                pole_model, *LONE)  # fmt: skip
    assert done.code == 1
    errors = [text for text in done.err.splitlines() if text.startswith("error: ")]
    assert len(errors) == 1 and errors[0].startswith(f"error: {truth}: ")
    expected = {
        "fewer points": f"has {len(cloud) - 1} points, but {pole_survey} has {len(cloud)}",
        "moved point": "point 42: it lies at (",
        "folder": "the truth of a file cannot be a folder",
        "missing": "",
    }
    assert expected[fault] in errors[0]
    result = json.loads(done.out)  # the other file is scored
    assert result["voxel"]["n_samples"] == result["truth"]["voxel"]["n_samples"] == 1
    assert result["points"] == result["truth"]["points"]
