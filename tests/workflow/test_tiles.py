"""A survey of many tiles in the workflow: tile by tile, with the result of the uncut survey."""

from __future__ import annotations

import csv
import json
import re
from collections import Counter
from pathlib import Path

import laspy
import numpy as np
import pyproj
import pytest
import yaml
from fixtures.project import PARTS, copy_parts
from fixtures.scenes import make_wire_finder, wire_points

from scenenet.models.model_file import write_model
from scenenet.pointcloud import PointCloud, write_las

pytestmark = pytest.mark.workflow

ROW = "results/predict/{0}"
STAGES = ("read_tile", "predict_tile", "observe_tile", "find_towers", "conductors", "clearances",
          "write_tile", "survey_lists")  # fmt: skip
RULES = (*STAGES, "predict", "voxel_size", "survey_complete", "review")
DONE = re.compile(r"^Finished jobid: \d+ \(Rule: (\w+)\)", re.MULTILINE)
UTM = pyproj.CRS(32629)


def write(path: Path, xyz: np.ndarray, codes: np.ndarray) -> None:
    path.parent.mkdir(exist_ok=True, parents=True)
    write_las(path, PointCloud(xyz, codes, crs=UTM))


def run(project, *files: str) -> tuple[int, Counter[str], str]:
    """Make files of results; the exit status, the jobs of each rule and what was shown."""
    done = project.snakemake(*files, "--allowed-rules", *RULES)
    return done.returncode, Counter(DONE.findall(done.stdout)), done.stdout


@pytest.fixture(scope="module")
def first(project_in, project_root, tmp_path_factory, pole_finder, scene):
    """A project after its first run: a survey as one file, and cut into tiles, one of them broken.

    There are three poles in three tiles, with a wire from the first to the last one, and one pole
    in a tile 3 km to the east.
    """
    project = project_in(tmp_path_factory.mktemp("tiled") / "project")
    copy_parts(project_root, project.folder, PARTS)
    test = yaml.safe_load((project.folder / "config" / "test.yaml").read_text())
    own = {"results_dir": "results", "surveys": "config/surveys.tsv", "studies": []}
    own["observers"] = [{"name": "wires", "target": "wire"}]
    project.configure({**test, **own, "detection": {"min_conductor": 0}})
    # The rules that train it are not among those that may run.
    (project.results / "models").mkdir(parents=True)
    write_model(project.results / "models" / "scenenet.json", *pole_finder)
    write_model(project.results / "models" / "wires.json", *make_wire_finder())
    (project.folder / "config" / "surveys.tsv").write_text("survey\tpath\tcodes\trole\n")
    project.add_row("first", "{results_dir}/synthetic/first.laz", "edp", "train")
    near = scene([(15.5, 15.5), (60.5, 15.5), (105.5, 15.5)], size=(121.0, 31.0), tree=(40.0, 20.0))
    far = scene([(15.5, 15.5)], size=(31.0, 31.0), tree=None, seed=3)
    wire = wire_points((15.5, 60.5, 105.5), 15.5, 13.8, 15.5, 105.5)
    xyz = np.concatenate([near.xyz, wire, far.xyz + np.array([3000.0, 0, 0])])
    codes = np.concatenate([near.classification, np.full(len(wire), 16), far.classification])
    codes = codes.astype(np.uint8)
    write(project.folder / "data" / "whole.laz", xyz, codes)
    # The first cut is through a pole, and no border of voxels.
    west = near.xyz[:, 0].min()
    part = np.searchsorted([west + 15.3, west + 77.0, west + 1000], xyz[:, 0])
    for number, name in enumerate(("a 0", "a 1", "a 2", "b")):
        own = part == number
        write(project.folder / "data" / "tiles" / f"{name}.laz", xyz[own], codes[own])
    (project.folder / "data" / "tiles" / "bad.laz").write_bytes(b"<!DOCTYPE html>")
    project.add_row("whole", "data/whole.laz", "edp", "new")
    project.add_row("tiles", "data/tiles", "edp", "new")
    code, jobs, shown = run(
        project, ROW.format("whole/whole.laz"), ROW.format("tiles/complete.json")
    )
    return project, code, jobs, shown


def rows(paths) -> np.ndarray:
    """Every point with what was predicted for it, sorted."""
    found = []
    for path in paths:
        p = laspy.read(path)
        probability = np.asarray(p.tower_probability).view(np.uint32)
        steps = np.round(np.column_stack([p.x, p.y, p.z]) * 1000).astype(int)  # files have offsets
        wire = np.asarray(p.wire_probability).view(np.uint32)
        own = p.tower_id, probability, wire, p.span_id, p.conductor_id
        found.append(np.column_stack([steps, *own]))
    table = np.concatenate(found)
    return table[np.lexsort(table.T)]


def test_the_tiles_give_the_list_and_the_points_of_the_uncut_survey(first):
    folder = first[0].results / "predict"
    lists = ("towers.csv", "towers.geojson", "spans.csv", "conductors.csv", "clearances.csv")
    for ending in lists:
        whole, tiles = (folder / name / f"{name}.{ending}" for name in ("whole", "tiles"))
        assert tiles.read_bytes() == whole.read_bytes()
    written = sorted((folder / "tiles" / "tiles").glob("*.laz"))
    assert [path.name for path in written] == ["a 0.laz", "a 1.laz", "a 2.laz", "b.laz"]
    whole = rows([folder / "whole" / "whole.laz"])
    assert len(np.unique(whole[:, 3])) == 1 + 4
    assert whole[:, 6].any() and whole[:, 7].any()  # span and conductor
    np.testing.assert_array_equal(rows(written), whole)


def test_a_broken_tile_stops_no_other_and_is_said_at_the_end(first):
    project, code, jobs, shown = first
    assert code != 0
    assert jobs == {"voxel_size": 1, "read_tile": 5, "predict_tile": 5, "observe_tile": 5,
                    "find_towers": 1, "conductors": 1, "clearances": 1, "write_tile": 4,
                    "survey_lists": 1, "predict": 1}  # fmt: skip
    assert "1 of 5 tiles are not predicted" in shown
    assert "failed: data/tiles/bad.laz: the suffix is .laz, but the content is a web page" in shown
    with (project.results / "predict/tiles/tiles/status.csv").open(newline="") as stream:
        status = {row["file"]: row["status"] for row in csv.DictReader(stream)}
    assert status.pop("bad.laz") == "failed"
    assert set(status.values()) == {"predicted"} and len(status) == 4
    summary = json.loads((project.results / "predict/tiles/tiles.summary.json").read_text())
    [bad] = [file for file in summary["files"] if file["file"] == "bad.laz"]
    assert "web page" in bad["error"]


def test_a_new_tile_makes_itself_its_neighbours_and_the_list(first, scene):
    project = first[0]
    tiles = project.folder / "data" / "tiles"
    written = project.results / "predict/tiles/tiles"
    before = {path.name: path.stat().st_mtime_ns for path in written.glob("*.laz")}
    (tiles / "bad.laz").unlink()
    extra = scene([(15.5, 15.5)], size=(31.0, 31.0), tree=None, seed=4)
    write(tiles / "c.laz", extra.xyz + np.array([3000.0, 80.0, 0]), extra.classification)
    wanted = (ROW.format("tiles/complete.json"), "--allowed-rules", *RULES)
    shown = project.run("-n", *wanted, "--quiet", "host")
    planned = re.findall(r"(?:Reading|Predicting) tile (\w.*) of tiles", shown)
    assert sorted(planned) == ["b", "b", "c", "c", "c"]  # with either model
    code, jobs, shown = run(project, ROW.format("tiles/complete.json"))
    assert code == 0, shown
    # Nothing changes in tile b, the neighbour, so its points are not written again.
    assert jobs == {"read_tile": 1, "predict_tile": 2, "observe_tile": 2, "find_towers": 1,
                    "conductors": 1, "clearances": 1, "write_tile": 1, "survey_lists": 1,
                    "survey_complete": 1}  # fmt: skip
    after = {path.name: path.stat().st_mtime_ns for path in written.glob("*.laz")}
    assert before.items() <= after.items() and after.keys() - before.keys() == {"c.laz"}
    assert len((written.parent / "tiles.towers.csv").read_text().splitlines()) == 1 + 5
    code, jobs, shown = run(project, ROW.format("tiles/complete.json"))
    assert (code, jobs) == (0, {})


def test_a_rejected_conductor_writes_its_tiles_and_no_others(first):
    project = first[0]
    folder = project.results / "predict/tiles"

    def spans() -> list[str]:
        with (folder / "tiles.spans.csv").open(newline="") as stream:
            return [row["span_id"] for row in csv.DictReader(stream)]

    before = spans()
    reviews = project.folder / "reviews"
    reviews.mkdir()
    decisions = reviews / "tiles.csv"
    decisions.write_text(f"span,conductor,decision\n{before[0]},1,reject\n")
    code, jobs, shown = run(project, ROW.format("tiles/complete.json"))
    assert code == 0, shown
    assert not jobs.keys() & {"read_tile", "predict_tile", "observe_tile", "find_towers"}
    assert jobs["conductors"] == jobs["clearances"] == jobs["survey_lists"] == 1
    names = set(re.findall(r"Writing tile (.*) of tiles", shown))
    assert "a 1" in names and not {"b", "c"} & names
    assert spans() == before[1:]
    written = np.concatenate([laspy.read(p).span_id for p in (folder / "tiles").glob("*.laz")])
    assert {str(number) for number in written} == {"0", *before[1:]}
    # The decision stays valid, and what is said of towers changes no prediction.
    decisions.write_text(decisions.read_text() + ",,comment\n")
    record = "results/review/tiles/tiles.reviewed.json"
    code, jobs, shown = run(project, record, ROW.format("tiles/complete.json"))
    assert (code, jobs) == (1, {}), shown  # a comment on nothing
    decisions.write_text(f"span,conductor,decision,comment\n{before[0]},1,reject,twigs\n")
    code, jobs, shown = run(project, record, ROW.format("tiles/complete.json"))
    assert (code, jobs) == (0, {"review": 1}), shown
    counts = json.loads((project.folder / record).read_text())["conductors"]
    assert (counts["found"], counts["rejected"], counts["comments"]) == (len(before), 1, 1)
    decisions.unlink()
    code, jobs, shown = run(project, ROW.format("tiles/complete.json"))
    assert code == 0 and spans() == before, shown


def test_a_tower_at_a_seam_that_changes_writes_the_tiles_that_it_reaches_into(first, scene):
    """Half of a pole is taken away; the tile with its other half is written again too."""
    project = first[0]
    tile = project.folder / "data" / "tiles" / "a 0.laz"
    points = laspy.read(tile)
    points.points = points.points[np.asarray(points.x) < points.header.mins[0] + 10]
    points.write(tile)
    code, jobs, shown = run(project, ROW.format("tiles/complete.json"))
    assert code == 0, shown
    assert jobs["read_tile"] == 1
    assert jobs["predict_tile"] == 3
    names = re.findall(r"Writing tile (.*) of tiles", shown)
    assert {"a 0", "a 1"} <= set(names) and not {"b", "c"} & set(names)


def test_a_tile_whose_header_hides_points_is_named(first):
    """Its neighbours are told by its header."""
    project = first[0]
    tile = project.folder / "data" / "tiles" / "b.laz"
    data = bytearray(tile.read_bytes())
    at = 179  # the highest x, a double
    high = np.frombuffer(data[at : at + 8], "<f8")[0]
    data[at : at + 8] = np.array([high - 5.0], "<f8").tobytes()
    tile.write_bytes(data)
    code, jobs, shown = run(project, ROW.format("tiles/complete.json"))
    assert code != 0
    assert "outside the bounding box of its header" in shown
    assert jobs["survey_lists"] == 1


def test_another_model_of_wires_makes_what_follows_from_wires_and_no_towers(first):
    project = first[0]
    found, card = make_wire_finder()
    write_model(project.results / "models" / "wires.json", found, card.with_tau(0.25))
    _, jobs, shown = run(project, ROW.format("tiles/complete.json"))
    assert jobs.keys() >= {"observe_tile", "conductors", "clearances", "survey_lists"}, shown
    assert not jobs.keys() & {"read_tile", "predict_tile", "find_towers"}
