"""A tile index names the files of a survey: VPC, STAC item collection, GeoPackage."""

from __future__ import annotations

import csv
import json
import zipfile
from pathlib import Path

import numpy as np
import pyogrio
import pytest
import shapely

from scenenet.core.errors import InputError
from scenenet.detection.settings import DetectionSettings
from scenenet.pointcloud import PointCloud, write_las
from scenenet.prediction.result_files import PredictionFiles
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.survey_files import SurveyFiles
from scenenet.prediction.tile_index import read_index
from scenenet.prediction.writers import predict_to_files


def item(href: object, name: object = "tile", **more: object) -> dict:
    """A STAC item as pdal_wrench writes it into a VPC."""
    return {
        "type": "Feature",
        "stac_version": "1.0.0",
        "id": name,
        "geometry": None,
        "properties": {"datetime": "2026-05-01T00:00:00Z", "pc:count": 1},
        "links": [],
        "assets": {"data": {"href": href, "roles": ["data"]}},
    } | more


def collection(path: Path, *items: object, **more: object) -> Path:
    path.write_text(json.dumps({"type": "FeatureCollection", "features": list(items)} | more))
    return path


def package(path: Path, column: str, values: list[object], layer: str = "tindex") -> Path:
    boxes = shapely.to_wkb(np.full(len(values), shapely.box(0, 0, 1, 1)))
    pyogrio.raw.write(
        path, layer=layer, driver="GPKG", geometry=boxes, geometry_type="Polygon",
        field_data=[np.array(values, object)], fields=[column], crs="EPSG:32629",
        append=path.exists(),
    )  # fmt: skip
    return path


@pytest.fixture
def tiles(tmp_path) -> Path:
    """A folder with two files, whose content does not matter."""
    folder = tmp_path / "tiles"
    folder.mkdir()
    for name in ("a.laz", "b.las"):
        (folder / name).write_bytes(b"LASF")
    return folder


def test_a_virtual_point_cloud_names_its_files_relative_to_itself(tiles, tmp_path):
    index = collection(tmp_path / "line.vpc", item("./tiles/b.las"), item("./tiles/a.laz"))
    survey = SurveyFiles.of(index)
    assert (survey.name, survey.tiled, survey.notes, survey.refused) == ("line", True, (), {})
    assert survey.files == (tiles / "b.las", tiles / "a.laz")


@pytest.mark.parametrize("ending", ["json", "geojson"])
def test_an_item_collection_may_have_other_assets(tiles, tmp_path, ending):
    assets = {
        "thumbnail": {"href": "./a.png", "roles": ["thumbnail"]},
        "overview": {"href": "./tiles/b.las", "roles": ["overview"]},
        "laz": {"href": (tiles / "a.laz").as_uri()},
    }
    index = collection(tmp_path / f"items.{ending}", item("", assets=assets))
    assert read_index(index).files == (tiles / "a.laz",)


def test_a_name_may_be_encoded_as_in_urls(tmp_path):
    (tmp_path / "a b.laz").write_bytes(b"LASF")
    index = collection(tmp_path / "x.vpc", item("./a%20b.laz"))
    assert read_index(index).files == (tmp_path / "a b.laz",)


@pytest.mark.parametrize("column", ["location", "Path", "filename"])
def test_a_geopackage_has_the_files_in_a_column(tiles, tmp_path, column):
    package(tmp_path / "index.gpkg", "note", ["nothing"], layer="notes")
    index = package(tmp_path / "index.gpkg", column, ["tiles/a.laz", str(tiles / "b.las")])
    assert read_index(index).files == (tiles / "a.laz", tiles / "b.las")


def test_a_geopackage_may_have_paths_from_the_working_directory(tiles, tmp_path, monkeypatch):
    monkeypatch.chdir(tiles)
    (tmp_path / "elsewhere").mkdir()
    index = package(tmp_path / "elsewhere" / "index.gpkg", "location", ["a.laz", "missing.laz"])
    here, missing = read_index(index).files
    assert here.resolve() == tiles / "a.laz"
    assert missing == index.parent / "missing.laz"


def test_entries_that_are_no_local_file_are_named_and_stop_no_other(tiles, tmp_path):
    index = collection(
        tmp_path / "line.vpc",
        item("https://example.org/c.laz?token=1", "c"),
        item("./tiles/a.laz"),
        item("./ept.json", "d"),
        item(5, "e"),
        item("", "f"),
        item("./\ud800.laz", "g"),
        item("./" + "x" * 300 + ".laz", "h"),
        "no item",
    )
    index_of = read_index(index)
    assert index_of.files == (tiles / "a.laz",)
    problems = {path.name: str(error) for path, error in index_of.refused.items()}
    assert list(problems) == [
        "item 1 (c)", "item 3 (d)", "item 4 (e)", "item 5 (f)", "item 6 (g)", "item 7 (h)",
        "item 8",
    ]  # fmt: skip
    assert "https://example.org/c.laz?token=1 is not on this machine" in problems["item 1 (c)"]
    assert "line.vpc: item 3 (d): ./ept.json is not a LAS or LAZ file" in problems["item 3 (d)"]
    for name in ("item 4 (e)", "item 5 (f)", "item 8"):
        assert "names no file" in problems[name]
    for name in ("item 6 (g)", "item 7 (h)"):
        assert "cannot be the name of a file" in problems[name]


@pytest.mark.parametrize("remote", ["s3://b/c.laz", "HTTP://x/c.laz", "/vsicurl/http://x/c.laz"])
def test_urls_of_every_kind_are_refused(tiles, tmp_path, remote):
    index = package(tmp_path / "index.gpkg", "location", [remote, None, "tiles/a.laz"])
    found = read_index(index)
    assert found.files == (tiles / "a.laz",)
    first, second = map(str, found.refused.values())
    assert "not on this machine" in first and "layer tindex: row 1" in first
    assert "names no file" in second


def test_a_file_that_is_listed_twice_is_read_once_and_counted(tiles, tmp_path):
    (tmp_path / "link.laz").symlink_to(tiles / "a.laz")
    hrefs = ["tiles/a.laz", "./tiles/../tiles/a.laz", "link.laz", "tiles/b.las", "tiles/b.las"]
    found = read_index(collection(tmp_path / "x.vpc", *map(item, hrefs)))
    assert found.files == (tiles / "a.laz", tiles / "b.las")
    assert found.notes == (
        "files that are listed more than once are read once: a.laz, b.las; "
        "repeated entries left out: 3",
    )


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("{", "not JSON"),
        ("[" * 100_000, "not JSON"),
        ('{"type": "Collection", "links": []}', "no item in it has assets.*'Collection'"),
        ('{"type": "FeatureCollection", "features": []}', "no item in it has assets"),
        ('{"features": [{"type": "Feature", "properties": {}}]}', "no item in it has assets"),
        ("[]", "no item in it has assets"),
    ],
)
def test_other_json_is_no_index(tmp_path, text, reason):
    (tmp_path / "x.json").write_text(text)
    with pytest.raises(InputError, match=reason):
        SurveyFiles.of(tmp_path / "x.json")


def test_one_page_of_an_item_collection_is_refused(tiles, tmp_path):
    links = [{"rel": "self", "href": "x"}, {"rel": "next", "href": "https://example.org/2"}]
    index = collection(tmp_path / "x.json", item("./tiles/a.laz"), links=links)
    with pytest.raises(InputError, match="continues in another file"):
        SurveyFiles.of(index)


def test_other_geopackages_are_no_index(tmp_path):
    with pytest.raises(InputError, match="no layer has a column location, path or filename"):
        SurveyFiles.of(package(tmp_path / "x.gpkg", "name", ["a"]))
    (tmp_path / "y.gpkg").write_bytes(b"SQLite format 3\0 and no more")
    with pytest.raises(InputError, match=r"y\.gpkg: the tile index cannot be read"):
        SurveyFiles.of(tmp_path / "y.gpkg")
    with pytest.raises(InputError, match="names no file"):
        SurveyFiles.of(package(tmp_path / "z.gpkg", "location", []))


def test_files_of_one_name_keep_their_folders(tmp_path):
    for folder in ("north", "south"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "1.laz").write_bytes(b"LASF")
    index = collection(tmp_path / "x.vpc", item("north/1.laz"), item("south/1.laz"))
    survey = SurveyFiles.of(index)
    assert list(survey.names.values()) == ["north/1.laz", "south/1.laz"]
    results = PredictionFiles.of(survey, tmp_path / "out")
    folder = tmp_path / "out" / "x"
    assert list(results.points.values()) == [folder / "north/1.laz", folder / "south/1.laz"]


def test_the_tiles_of_an_index_are_predicted_as_one_survey(scene, model, tmp_path):
    cloud = scene([(15.5, 15.5), (60.5, 15.5)], size=(76.0, 31.0), tree=None)
    west = cloud.xyz[:, 0] < cloud.xyz[:, 0].min() + 38
    for name, part in (("west", west), ("east", ~west)):
        write_las(tmp_path / f"{name}.laz", PointCloud(cloud.xyz[part], cloud.classification[part]))
    index = collection(
        tmp_path / "line.vpc",
        item("./west.laz"),
        item("./gone.laz"),
        item("s3://bucket/more.laz"),
        item("./east.laz"),
        item("./east.laz"),
    )
    survey = SurveyFiles.of(index)
    files = PredictionFiles.of(survey, tmp_path / "out")
    summary = predict_to_files(
        survey, model, files, PredictSettings(), DetectionSettings(min_conductor=0)
    )
    assert (summary.towers, summary.points) == (2, len(cloud))
    assert summary.warnings[0].endswith("read once: east.laz; repeated entries left out: 1")
    with files.status.open(newline="") as stream:
        table = {row["file"]: row for row in csv.DictReader(stream)}
    assert {name: row["status"] for name, row in table.items()} == {
        "west.laz": "predicted", "gone.laz": "failed", "east.laz": "predicted",
        "item 3 (tile)": "failed",
    }  # fmt: skip
    assert "there is no such file" in table["gone.laz"]["error"]
    assert [table[name]["towers"] for name in ("west.laz", "east.laz")] == ["1", "1"]
    assert sorted(path.name for path in (tmp_path / "out" / "line").iterdir()) == [
        "east.laz", "status.csv", "west.laz",
    ]  # fmt: skip


def zipped(path: Path, **members: str) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in members.items():
            archive.writestr(name.replace("_", "."), content)
    return path


def test_a_zipped_virtual_point_cloud_names_files_beside_the_archive(tiles):
    content = collection(tiles / "all.vpc", item("./a.laz"), item("./b.las")).read_text()
    index = zipped(tiles / "all.vpz", all_vpc=content, all_overview_copc_laz="not looked at")
    assert read_index(index).files == (tiles / "a.laz", tiles / "b.las")
    assert SurveyFiles.of(index).tiled


@pytest.mark.parametrize(
    ("members", "message"),
    [
        ({"readme_txt": ""}, "0 virtual point clouds"),
        ({"a_vpc": "{}", "b_vpc": "{}"}, "2 virtual point clouds"),
        ({"a_vpc": "{"}, "not JSON"),
    ],
)
def test_an_archive_without_one_readable_index_is_refused(tmp_path, members, message):
    with pytest.raises(InputError, match=message):
        read_index(zipped(tmp_path / "all.vpz", **members))


def test_a_damaged_archive_is_refused(tmp_path, tiles):
    content = collection(tiles / "all.vpc", item("./a.laz")).read_text()
    index = zipped(tmp_path / "all.vpz", all_vpc=content)
    for broken in (index.read_bytes()[:60], b"", b"<html>"):
        index.write_bytes(broken)
        with pytest.raises(InputError, match="the archive cannot be read"):
            read_index(index)
