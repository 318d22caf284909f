"""A review as labels: what the next training and scoring read."""

from __future__ import annotations

import json
from pathlib import Path

import laspy
import numpy as np
import pytest
from fixtures.review_files import place, rows_of, write_rows
from fixtures.scenes import PLACE

from scenenet.dataset.labelled_towers import TowerSettings, survey_towers
from scenenet.pointcloud import PointCloud, class_scheme, write_las
from scenenet.review.labels.points import Points
from scenenet.review.labels.relabel import Codes, Relabelling
from scenenet.review.merge import Review
from scenenet.review.reviewed_tower import ReviewedTower

TOWER, OTHER = 15, 1
ADDED = (PLACE[0] + 95.5, PLACE[1] + 33.5)
COLUMNS = ("id", "x", "y", "decision")


@pytest.fixture
def review(towers, tmp_path) -> Path:
    """One tower accepted, one rejected, one added that was not found."""
    rows = [
        (towers[0]["id"], "", "", "accept"),
        (towers[1]["id"], "", "", "reject"),
        ("", *ADDED, "add"),
    ]
    return write_rows(tmp_path / "review.csv", COLUMNS, rows)


def labelled(call, found: Path, review: Path, out: Path, *more: object) -> dict:
    arguments = ("--labels", out, "--codes", "edp", "--out", out.parent, "--json", *more)
    done = call("review", found, "--decisions", review, *arguments)
    assert done.code == 0, done.err
    return json.loads(done.out)


def places_of(path: Path) -> np.ndarray:
    """Places of the towers in the labels of a file."""
    return survey_towers(path, "edp", TowerSettings()).towers[["x", "y"]].to_numpy()


def has(places: np.ndarray, at: tuple[float, float]) -> bool:
    return bool((np.hypot(*(places - at).T) < 1.0).any())


def test_accepted_and_added_towers_are_labelled_and_rejected_ones_are_not(
    call, found, towers, review, tmp_path
):
    out = tmp_path / "labelled.laz"
    result = labelled(call, found, review, out)
    places = places_of(out)
    assert len(places) == 2
    assert has(places, place(towers[0])) and has(places, ADDED)
    before, after = laspy.read(found / "line.laz"), laspy.read(out)
    assert (before.xyz == after.xyz).all()
    own = np.asarray(before.tower_id) == int(towers[0]["id"])
    assert (np.asarray(after.classification)[own] == TOWER).all()
    rejected = np.asarray(before.tower_id) == int(towers[1]["id"])
    assert rejected.any() and (np.asarray(after.classification)[rejected] != TOWER).all()
    assert int(towers[1]["id"]) not in np.asarray(after.tower_id)
    assert result["labels"]["tower_points"] == (np.asarray(after.classification) == TOWER).sum()
    [added] = [r for r in rows_of(tmp_path / "line.reviewed.csv") if r["decision"] == "added"]
    assert float(added["height"]) == pytest.approx(8.0, abs=0.3)
    assert float(added["base"]) == pytest.approx(PLACE[2], abs=0.2)
    assert int(added["points"]) == (np.asarray(after.tower_id) == int(added["id"])).sum() > 100


def test_a_rejected_and_an_added_tower_change_the_next_training_and_its_scores(
    call, found, towers, review, pole_model, tmp_path
):
    nothing = write_rows(tmp_path / "none.csv", COLUMNS, [(towers[0]["id"], "", "", "accept")])
    files = {"before": nothing, "after": review}
    trained, scores, crops = {}, {}, {}
    for name, decisions in files.items():
        survey = tmp_path / name / "survey.laz"
        labelled(call, found, decisions, survey, "--accept-rest")
        model = tmp_path / f"{name}.json"
        done = call("train", survey, "--codes", "edp", "--out", model, "--voxel-size", 1,
                    "--protocol", "thesis", "--epochs", 1, "--seeds", 1, "--validation", 0,
                    "--json")  # fmt: skip
        assert done.code == 0, done.err
        crops[name] = json.loads(done.out)["crops"]["training"]
        trained[name] = json.loads(model.read_text())
        done = call("evaluate", survey, "--codes", "edp", "--model", pole_model, "--fit", "metric",
                    "--min-conductor", 0, "--json")  # fmt: skip
        assert done.code == 0, done.err
        scores[name] = json.loads(done.out)["towers"]
    # Of 12 towers one was rejected and one added.
    assert crops == {"before": 12, "after": 12}
    assert trained["before"]["provenance"]["data"] != trained["after"]["provenance"]["data"]
    assert trained["before"]["geneos"] != trained["after"]["geneos"]
    assert scores["before"]["precision"] == scores["before"]["recall"] == 1.0
    assert scores["before"]["n_true"] == scores["after"]["n_true"] == 12
    # The model still finds the rejected tower, and not the added one.
    assert scores["after"]["precision"] == scores["after"]["recall"] == pytest.approx(11 / 12)


def test_towers_without_a_decision_are_only_labelled_when_that_is_said(
    call, found, towers, review, tmp_path
):
    labelled(call, found, review, tmp_path / "a.laz")
    labelled(call, found, review, tmp_path / "b.laz", "--accept-rest")
    assert [len(places_of(tmp_path / f"{n}.laz")) for n in "ab"] == [2, 12]


def test_an_added_tower_without_a_body_has_no_label_and_this_is_said(call, found, tmp_path):
    review = write_rows(
        tmp_path / "review.csv", COLUMNS, [("", PLACE[0] + 65.5, PLACE[1] + 5, "add")]
    )
    out = tmp_path / "labelled.laz"
    arguments = ("--labels", out, "--codes", "edp", "--out", tmp_path)
    done = call("review", found, "--decisions", review, *arguments)
    assert done.code == 0
    assert "no body stands at its place" in done.out
    assert len(places_of(out)) == 0
    assert rows_of(tmp_path / "line.reviewed.csv")[-1]["decision"] == "added"


def test_tiles_are_labelled_one_by_one(call, scene, pole_model, tmp_path):
    cloud = scene([(20.5, 20.5), (60.5, 20.5)], size=(80.0, 41.0), tree=None)
    tiles = tmp_path / "tiles"
    for name, inside in (("a", cloud.xyz[:, 0] < PLACE[0] + 60.5), ("b", None)):
        part = ~(cloud.xyz[:, 0] < PLACE[0] + 60.5) if inside is None else inside
        codes = np.ones(int(part.sum()), np.uint8)
        (tiles).mkdir(exist_ok=True)
        write_las(tiles / f"{name}.laz", PointCloud(cloud.xyz[part], codes))
    out = tmp_path / "found"
    done = call("predict", tiles, "--model", pole_model, "--out", out, "--min-conductor", 0)
    assert done.code == 0, done.err
    [west, east] = sorted(rows_of(out / "tiles.towers.csv"), key=lambda row: row["x"])
    rows = [(west["id"], "", "", "accept"), (east["id"], "", "", "reject"),
            ("", float(east["x"]) + 0.2, east["y"], "add")]  # fmt: skip
    review = write_rows(tmp_path / "review.csv", COLUMNS, rows)
    refused = call("review", out, "--decisions", review, "--codes", "edp", "--labels", "l.laz")
    assert refused.code == 1 and "labelled into a folder" in refused.err
    done = call("review", out, "--decisions", review, "--codes", "edp", "--out", tmp_path,
                "--labels", tmp_path / "labels")  # fmt: skip
    assert done.code == 0, done.err
    counts = {}
    for name in "ab":
        points = laspy.read(tmp_path / "labels" / f"{name}.laz")
        for number in np.unique(points.tower_id[np.asarray(points.classification) == TOWER]):
            counts.setdefault(int(number), []).append(name)
    [added] = [
        r["id"] for r in rows_of(tmp_path / "tiles.reviewed.csv") if r["decision"] == "added"
    ]
    # The seam goes through the tower that was added, and both files have its points.
    assert counts == {int(west["id"]): ["a"], int(added): ["a", "b"]}


def test_points_that_cannot_be_labelled_are_named(call, found, review, scene, pole_model, tmp_path):
    alone = tmp_path / "alone"
    alone.mkdir()
    (alone / "line.towers.csv").write_bytes((found / "line.towers.csv").read_bytes())
    options = ("--decisions", review, "--labels", tmp_path / "l.laz", "--codes")
    done = call("review", alone, *options, "edp")
    assert done.code == 1 and "the points of the prediction are not beside the list" in done.err
    done = call("review", found, *options, "ts40k")
    assert done.code == 1 and "has no class 'Unclassified'" in done.err
    assert not (found / "line.reviewed.csv").exists()
    done = call(
        "review", found, "--decisions", review, "--labels", tmp_path / "l", "--codes", "edp"
    )
    assert done.code == 1 and "is a .laz or .las file" in done.err
    survey = tmp_path / "field.laz"
    write_las(survey, scene([(15.5, 15.5)]))
    out = tmp_path / "classified"
    predict = ("predict", survey, "--model", pole_model, "--out", out, "--min-conductor", 0)
    assert call(*predict, "--classify").code == 0
    done = call("review", out, *options, "edp")
    assert done.code == 1 and "labels cannot be distinguished from what was found" in done.err


def test_labels_around_a_rejected_tower_end_and_those_of_its_neighbour_stay():
    """Annotators label everything around a tower, not only its own points."""
    rng = np.random.default_rng(0)
    far, near = np.array([0.0, 0.0]), np.array([12.0, 0.0])
    xyz = np.concatenate(
        [np.column_stack([at + rng.uniform(-4, 4, (400, 2)), rng.uniform(0, 20, 400)])
         for at in (far, near)]
    )  # fmt: skip
    own = np.hypot(xyz[:, 0], xyz[:, 1]) < 1
    beside = np.hypot(xyz[:, 0] - 12, xyz[:, 1]) < 1
    points = Points(xyz, np.full(800, TOWER, np.uint8), np.where(own, 7, np.where(beside, 8, 0)))
    towers = (
        ReviewedTower(7, 0.0, 0.0, 0.0, {}, "rejected"),
        ReviewedTower(8, 12.0, 0.0, 0.0, {}, "not reviewed"),
    )
    relabelling = Relabelling(Review(towers), {}, Codes.of(class_scheme("edp")))
    codes, numbers = relabelling.apply(points, relabelling.cleared(xyz))
    assert (codes[:400] == OTHER).all() and (codes[400:] == TOWER).all()
    assert set(numbers) == {0, 8}


@pytest.mark.parametrize("name", ["pylon_002", "pylon_003"])
def test_a_recorded_pylon_that_is_added_again_gets_the_points_that_it_had(
    call, real_data, tmp_path, name
):
    """A person points 1.5 m beside its axis; it is measured there as it was found."""
    done = call("predict", real_data / "pylons" / f"{name}.laz", "--out", tmp_path / "found")
    assert done.code == 0, done.err
    [tower] = rows_of(tmp_path / "found" / f"{name}.towers.csv")
    x, y = place(tower)
    rows = [(tower["id"], "", "", "reject"), ("", x + 1.5, y, "add")]
    review = write_rows(tmp_path / "review.csv", COLUMNS, rows)
    labelled(call, tmp_path / "found", review, tmp_path / "labelled.laz")
    before = laspy.read(tmp_path / "found" / f"{name}.laz").tower_id > 0
    after = laspy.read(tmp_path / "labelled.laz").tower_id > 0
    assert (before & after).sum() / (before | after).sum() > 0.9
    [added] = rows_of(tmp_path / f"{name}.reviewed.csv")
    # Its axis lies some centimetres beside, on steep ground.
    assert float(added["height"]) == pytest.approx(float(tower["height"]), abs=0.1)
    assert added["conductor_directions"] == tower["conductor_directions"]
