"""A survey of several files: any cut gives the result of the uncut survey."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import laspy
import numpy as np
import pyogrio
import pyproj
import pytest

from scenenet.core.errors import InputError
from scenenet.detection.settings import DetectionSettings
from scenenet.pointcloud import PointCloud, write_las
from scenenet.prediction.result_files import PredictionFiles
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.survey_files import SurveyFiles, look_at
from scenenet.prediction.writers import predict_to_files

LONE_POLES = DetectionSettings(min_conductor=0)
UTM = pyproj.CRS(32629)


@pytest.fixture(scope="module")
def uncut(scene, tmp_path_factory) -> Path:
    """Three poles and a tree."""
    cloud = scene(
        [(15.5, 15.5), (60.5, 15.5), (105.5, 15.5)], size=(121.0, 31.0), tree=(40.0, 20.0)
    )
    path = tmp_path_factory.mktemp("uncut") / "line.laz"
    write_las(path, PointCloud(cloud.xyz, cloud.classification, crs=UTM))
    return path


@pytest.fixture(scope="module")
def whole(uncut, model, tmp_path_factory) -> PredictionFiles:
    return predict(uncut, model, tmp_path_factory.mktemp("whole"))


def predict(survey: Path, model: Path, folder: Path) -> PredictionFiles:
    named = SurveyFiles.of(survey)
    files = PredictionFiles.of(named, folder)
    predict_to_files(named, model, files, PredictSettings(), LONE_POLES)
    return files


def cut(survey: Path, folder: Path, part: np.ndarray) -> Path:
    """A folder with a file for each part (n,) of the points."""
    points = laspy.read(survey)
    folder.mkdir()
    for number in np.unique(part):
        tile = laspy.LasData(points.header)
        tile.points = points.points[part == number]
        tile.write(folder / f"tile-{number}.laz")
    return folder


def random_parts(survey: Path, seed: int) -> np.ndarray:
    """Parts of the points by cuts at random places, some of them on the borders of voxels."""
    points, draw = laspy.read(survey), np.random.default_rng(seed)
    low, high = points.header.mins[0], points.header.maxs[0]
    at = draw.uniform(low, high, draw.integers(1, 5))
    at[0] = np.round(at[0])
    part = np.searchsorted(np.sort(at), points.x, side="right")
    return 2 * part + (points.y > draw.uniform(*points.header.mins[1:2], points.header.maxs[1]))


def rows(files: PredictionFiles) -> np.ndarray:
    """Every point with what was predicted for it, sorted."""
    found = []
    for path in files.points.values():
        points = laspy.read(path)
        probability = np.asarray(points.tower_probability).view(np.uint32)
        found.append(np.column_stack([points.X, points.Y, points.Z, points.tower_id, probability]))
    table = np.concatenate(found)
    return table[np.lexsort(table.T)]


@pytest.mark.parametrize("seed", range(6))
def test_any_cut_gives_the_uncut_result(uncut, whole, model, tmp_path, seed):
    tiles = cut(uncut, tmp_path / "tiles", random_parts(uncut, seed))
    files = predict(tiles, model, tmp_path / "out")
    assert len(files.points) > 1
    assert files.table.read_bytes() == whole.table.read_bytes()
    assert files.geojson.read_bytes() == whole.geojson.read_bytes()
    np.testing.assert_array_equal(rows(files), rows(whole))


def ids(files: PredictionFiles) -> dict[tuple[int, int], str]:
    """Place of each tower in m -> its id in the list."""
    with files.table.open(newline="") as stream:
        return {
            (round(float(row["x"])), round(float(row["y"]))): row["id"]
            for row in csv.DictReader(stream)
        }


def test_a_tile_added_or_removed_elsewhere_changes_no_id(scene, uncut, whole, model, tmp_path):
    corridor = cut(uncut, tmp_path / "tiles", random_parts(uncut, 0))
    # The higher poles of the new tile come first in the list, and lie before the others in x and y.
    added = scene([(20.5, 15.5), (60.5, 15.5)], size=(81.0, 31.0), tree=None, seed=5, height=17.0)
    moved = added.xyz - (3000.0, 800.0, 0.0)
    write_las(corridor / "a-new.laz", PointCloud(moved, added.classification, crs=UTM))
    more = predict(corridor, model, tmp_path / "more")
    before, after = ids(whole), ids(more)
    assert len(before) == 3 and len(after) == 5
    assert {place: after[place] for place in before} == before
    in_points = {int(number) for number in np.unique(rows(more)[:, 3])}
    assert in_points == {0, *map(int, after.values())}

    points = laspy.read(uncut)
    east = laspy.LasData(points.header)
    east.points = points.points[points.x > points.header.mins[0] + 85]
    east.write(tmp_path / "east.laz")
    alone = ids(predict(tmp_path / "east.laz", model, tmp_path / "alone"))
    assert len(alone) == 1
    assert alone.items() <= before.items()


def test_each_file_is_written_under_its_name_and_the_lists_once(uncut, model, tmp_path):
    tiles = cut(uncut, tmp_path / "tiles", random_parts(uncut, 0))
    predict(tiles, model, tmp_path / "out")
    names = {
        path.relative_to(tmp_path / "out").as_posix() for path in (tmp_path / "out").rglob("*.*")
    }
    written = {f"tiles/{path.name}" for path in tiles.iterdir()} | {"tiles/status.csv"}
    endings = ("gpkg", "html", "summary.json", "towers.csv", "towers.geojson")
    assert names == written | {f"tiles.{ending}" for ending in endings}


def test_overlaps_of_files_do_no_harm(uncut, whole, model, tmp_path):
    points = laspy.read(uncut)
    middle = points.header.mins[0] + 60
    folder = tmp_path / "tiles"
    folder.mkdir()
    for name, chosen in (("west", points.x < middle + 20), ("east", points.x > middle - 20)):
        tile = laspy.LasData(points.header)
        tile.points = points.points[chosen]
        tile.write(folder / f"{name}.laz")
    files = predict(folder, model, tmp_path / "out")
    with files.table.open() as both, whole.table.open() as once:
        for tower, same in zip(csv.DictReader(both), csv.DictReader(once), strict=True):
            for name in ("id", "x", "y", "height", "base", "width"):
                assert float(tower[name]) == pytest.approx(float(same[name]), abs=0.01), name


def test_a_bad_file_is_named_and_stops_no_other(uncut, model, tmp_path):
    tiles = cut(uncut, tmp_path / "tiles", random_parts(uncut, 1))
    first, *others = sorted(tiles.iterdir())
    first.write_bytes(first.read_bytes()[:2000])
    files = predict(tiles, model, tmp_path / "out")
    assert not files.points[first].exists()
    assert all(files.points[path].exists() for path in others)
    record = {file["file"]: file for file in json.loads(files.summary.read_text())["files"]}
    assert record[first.name]["status"] == "failed"
    assert first.name in record[first.name]["error"]
    assert all(record[path.name]["status"] == "predicted" for path in others)
    layer = pyogrio.raw.read(files.geopackage, layer="tiles")
    status = dict(zip(layer[0]["fields"], layer[3], strict=True))
    assert list(status["file"]) == [path.name for path in sorted(tiles.iterdir())]
    assert list(status["status"]) == ["failed"] + ["predicted"] * len(others)
    with files.status.open(newline="") as stream:
        table = list(csv.DictReader(stream))
    assert table == [{name: str(value) for name, value in record[row["file"]].items()}
                     for row in table]  # fmt: skip
    assert [row["file"] for row in table] == list(status["file"])
    for path in others:
        numbers = np.asarray(laspy.read(files.points[path]).tower_id)
        assert record[path.name]["towers"] == len(set(numbers.tolist()) - {0})
        assert record[path.name]["tower_points"] == np.count_nonzero(numbers)
    assert sum(record[path.name]["towers"] for path in others) > 0


def test_a_survey_of_one_file_has_no_status_table(uncut, tmp_path):
    assert PredictionFiles.of(SurveyFiles.of(uncut), tmp_path).status is None


def test_a_file_in_another_system_is_left_out(uncut, model, tmp_path):
    tiles = cut(uncut, tmp_path / "tiles", random_parts(uncut, 2))
    last = sorted(tiles.iterdir())[-1]
    points = laspy.read(last)
    cloud = PointCloud(
        np.column_stack([points.x, points.y, points.z]), np.asarray(points.classification)
    )
    write_las(last, PointCloud(cloud.xyz, cloud.classification, crs=pyproj.CRS(32630)))
    files = predict(tiles, model, tmp_path / "out")
    record = json.loads(files.summary.read_text())["files"][-1]
    assert record["status"] == "left out"
    assert "WGS 84 / UTM zone 30N" in record["error"] and "zone 29N" in record["error"]


@pytest.mark.parametrize("name", ["tile-00.laz", "tile-99.laz"])
def test_a_file_without_points_and_system_is_named_as_empty(uncut, model, tmp_path, name):
    tiles = cut(uncut, tmp_path / "tiles", random_parts(uncut, 2))
    write_las(tiles / name, PointCloud(np.empty((0, 3)), np.empty(0, np.uint8)))
    files = predict(tiles, model, tmp_path / "out")
    record = {file["file"]: file for file in json.loads(files.summary.read_text())["files"]}
    assert record.pop(name)["error"].endswith(f"{name}: it has no points")
    assert {file["status"] for file in record.values()} == {"predicted"}


def test_a_file_without_a_system_is_left_out_with_the_option_that_names_it(uncut, tmp_path):
    tiles = cut(uncut, tmp_path / "tiles", random_parts(uncut, 2))
    points = PointCloud(np.ones((5, 3)), np.zeros(5, np.uint8))
    write_las(tiles / "z.laz", points)
    _, errors = look_at(SurveyFiles.of(tiles))
    assert "the file has no CRS" in str(errors[tiles / "z.laz"])
    assert "name the system of the survey with --crs" in str(errors[tiles / "z.laz"])


def test_a_survey_with_no_good_file_is_an_error(model, tmp_path):
    (tmp_path / "tiles").mkdir()
    (tmp_path / "tiles" / "a.laz").write_bytes(b"nothing")
    with pytest.raises(InputError, match="none of its 1 files can be used; the first error"):
        predict(tmp_path / "tiles", model, tmp_path / "out")
    assert not (tmp_path / "out" / "tiles.summary.json").exists()


def test_a_later_prediction_replaces_the_files_of_an_earlier_one(uncut, model, tmp_path):
    tiles = cut(uncut, tmp_path / "tiles", random_parts(uncut, 3))
    files = predict(tiles, model, tmp_path / "out")
    outputs = [*files.points.values(), *files.lists, files.summary]
    assert files.status in outputs
    assert all(files.is_own(path) for path in outputs)
    edited = next(iter(files.points.values()))
    edited.write_bytes(edited.read_bytes() + b" ")
    assert not files.is_own(edited)


def test_files_of_a_stopped_prediction_are_its_own(uncut, model, tmp_path, monkeypatch):
    tiles = cut(uncut, tmp_path / "tiles", random_parts(uncut, 4))

    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("scenenet.prediction.writers.write_layers", stop)
    files = PredictionFiles.of(SurveyFiles.of(tiles), tmp_path / "out")
    with pytest.raises(KeyboardInterrupt):
        predict_to_files(tiles, model, files, PredictSettings(), LONE_POLES)
    assert not files.summary.exists()
    assert all(files.is_own(path) for path in files.points.values())
    monkeypatch.undo()
    predict_to_files(tiles, model, files, PredictSettings(), LONE_POLES)
    assert not files.unfinished.exists()


def test_a_pattern_names_the_survey_by_its_folder(uncut, tmp_path):
    tiles = cut(uncut, tmp_path / "north", random_parts(uncut, 5))
    (tiles / "notes.txt").write_text("no survey")
    survey = SurveyFiles.of(tiles / "tile-*.laz")
    assert (survey.name, survey.tiled) == ("north", True)
    assert survey.files == SurveyFiles.of(tiles).files == tuple(sorted(tiles.glob("*.laz")))
    with pytest.raises(InputError, match="no LAS or LAZ file matches this pattern"):
        SurveyFiles.of(tiles / "*.xyz")
    assert SurveyFiles.of(tiles / "a.copc.laz").name == "a"
