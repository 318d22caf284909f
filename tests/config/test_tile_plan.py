"""What the workflow knows of the tiles of a survey before any job runs."""

from __future__ import annotations

import json

import numpy as np
import pyproj
import pytest

from scenenet.config import tile_plan
from scenenet.config.survey import Survey
from scenenet.config.tile_plan import NEIGHBOURS_M, UNREADABLE, HeaderCache, plan_tiles
from scenenet.core.provenance import fingerprint
from scenenet.pointcloud import PointCloud, write_las

LIMIT = 2**26


def tile(path, east: float, north: float = 0.0, crs: int = 32629, unit: float = 1.0) -> None:
    """A tile of 100 x 100 m."""
    path.parent.mkdir(exist_ok=True, parents=True)
    corners = np.array([[0, 0, 5.0], [100, 100, 9.0]])
    corners += np.array([500_000 + east, 4_630_000 + north, 0])
    cloud = PointCloud(corners / unit, np.zeros(2, np.uint8), crs=pyproj.CRS(crs))
    write_las(path, cloud)


def plan(folder, cache=None, crs=None):
    survey = Survey("line", str(folder), "edp", "new", "tiles", crs)
    return plan_tiles(survey, LIMIT, cache or HeaderCache(folder.parent / "cache.json"))


def test_tiles_within_the_distance_are_neighbours(tmp_path):
    folder = tmp_path / "tiles"
    places = {"a": 0, "b": 100 + NEIGHBOURS_M, "c": 200 + NEIGHBOURS_M * 2 + 1}
    for name, east in places.items():
        tile(folder / f"{name}.laz", east)
    tile(folder / "north.laz", 0, 100 + NEIGHBOURS_M)
    found = {name: each.neighbours for name, each in plan(folder).tiles.items()}
    assert found == {"a": ("b", "north"), "b": ("a", "north"), "c": (), "north": ("a", "b")}


def test_the_distance_is_in_metres_whatever_the_unit(tmp_path):
    foot = 0.3048006096012192
    for name, east in (("a", 0), ("b", 100 + NEIGHBOURS_M - 1), ("c", 200 + NEIGHBOURS_M * 2 + 5)):
        tile(tmp_path / "tiles" / f"{name}.laz", east, crs=2229, unit=foot)
    found = plan(tmp_path / "tiles").tiles
    assert found["a"].neighbours == ("b",) and found["c"].neighbours == ()
    assert found["a"].box[0] == pytest.approx(500_000 / foot)


def test_what_no_job_can_read_is_refused_and_the_rest_is_planned(tmp_path):
    folder = tmp_path / "tiles"
    tile(folder / "good.laz", 0)
    tile(folder / "two.las", 0)
    tile(folder / "two.laz", 0)
    tile(folder / "bra{ce}.laz", 0)
    (folder / "gone.laz").symlink_to("nowhere")
    (folder / "text.laz").write_text("no survey")
    tile(folder / ".half.laz", 0)
    planned = plan(folder)
    assert list(planned.tiles) == ["good", "text"]
    assert planned.tiles["text"].box is None
    problems = {path.name: error.problem for path, error in planned.survey.refused.items()}
    assert set(problems) == {"two.las", "two.laz", "bra{ce}.laz", "gone.laz"}
    assert "same name" in problems["two.las"]
    assert "a brace" in problems["bra{ce}.laz"]
    assert "not there" in problems["gone.laz"]
    assert planned.survey.name == "line"


def test_tiles_of_one_name_in_two_folders_keep_their_folders(tmp_path):
    for part in ("north", "south"):
        tile(tmp_path / part / "1.laz", 0)
    index = tmp_path / "all.vpc"
    items = [{"assets": {"data": {"href": f"{part}/1.laz"}}} for part in ("north", "south")]
    index.write_text(json.dumps({"features": items}))
    assert list(plan(index).tiles) == ["north/1", "south/1"]


def test_a_tile_is_not_opened_again_until_it_is_written(tmp_path, monkeypatch):
    folder, file = tmp_path / "tiles", tmp_path / "cache.json"
    tile(folder / "a.laz", 0)
    tile(folder / "b.laz", 200)
    cache = HeaderCache(file)
    first = plan(folder, cache)
    cache.save()
    opened = []
    look = tile_plan._look_at
    monkeypatch.setattr(tile_plan, "_look_at", lambda *a: opened.append(a[0].name) or look(*a))
    assert plan(folder, HeaderCache(file)) == first
    assert opened == []
    tile(folder / "b.laz", 200, 50)
    again = plan(folder, HeaderCache(file))
    assert opened == ["b.laz"]
    assert again.tiles["b"].known == fingerprint(folder / "b.laz")
    assert again.tiles["a"] == first.tiles["a"]
    file.write_text("{ not JSON")
    assert plan(folder, HeaderCache(file)) == again


def test_a_tile_without_permission_is_left_to_its_job(tmp_path, monkeypatch):
    folder = tmp_path / "tiles"
    tile(folder / "a.laz", 0)

    def refuse(*_):
        raise tile_plan.InputError("cannot be read", file=folder / "a.laz")

    monkeypatch.setattr(tile_plan, "fingerprint", refuse)
    assert plan(folder).tiles["a"].known == UNREADABLE
