"""A register compared with a real prediction: every difference that was made, and no other."""

from __future__ import annotations

import json

import numpy as np
import pyogrio
import pyproj
import pytest
import shapely
from fixtures.review_files import place, rows_of, write_rows
from hypothesis import given
from hypothesis import strategies as st

from scenenet.review.register.match import match

UNIT = 32629
OUTSIDE = 300.0
"""m, further than the survey reaches beyond its towers."""


@pytest.fixture
def register(towers) -> list[tuple[str, float, float]]:
    """A register of the line with 3 moved towers, 2 without a tower, 2 left out, 1 elsewhere."""
    rows = [(f"A{number}", *place(tower)) for number, tower in enumerate(towers)]
    for number, (east, north) in {1: (4.0, 0.0), 5: (0.0, -6.0), 8: (-2.0, 2.0)}.items():
        name, x, y = rows[number]
        rows[number] = (name, x + east, y + north)
    x, y = rows[0][1:]
    ghosts = [("G1", x + 15.0, y), ("G2", x + 75.0, y)]
    kept = [row for number, row in enumerate(rows) if number not in (3, 10)]
    return [*kept, *ghosts, ("B1", x, y + OUTSIDE)]


def by_status(entries: list[dict], key: str) -> dict[str, set]:
    found: dict[str, set] = {}
    for entry in entries:
        found.setdefault(entry["status"], set()).add(entry[key])
    return found


def test_every_difference_is_found_and_no_other(call, found, towers, register, tmp_path):
    assets = write_rows(tmp_path / "register.csv", ("asset", "x", "y"), register)
    done = call("register", found, "--assets", assets, "--out", tmp_path / "out", "--json")
    assert done.code == 0, done.err
    result = json.loads(done.out)
    assert result["counts"] == {
        "assets": 13, "towers": 12, "missing": 2, "moved": 3, "new": 2, "outside": 1,
        "without_place": 0, "matched": 7,
    }  # fmt: skip
    assets_by = by_status(result["entries"], "asset")
    assert assets_by["moved"] == {"A1", "A5", "A8"}
    assert assets_by["missing"] == {"G1", "G2"}
    assert assets_by["outside"] == {"B1"}
    assert by_status(result["entries"], "tower")["new"] == {
        int(towers[3]["id"]), int(towers[10]["id"]),
    }  # fmt: skip
    moved = next(entry for entry in result["entries"] if entry["asset"] == "A5")
    assert (moved["east_m"], moved["north_m"]) == pytest.approx((0.0, 6.0), abs=1e-6)
    assert result["shift_m"] == pytest.approx([0.0, 0.0], abs=1e-6)
    assert "nothing was written" not in done.out

    table = rows_of(tmp_path / "out" / "line.register.csv")
    lengths = [row[name] for row in table for name in ("tower_x", "distance_m", "east_m")]
    assert all(len(length.partition(".")[2]) <= 4 for length in lengths)
    assert [row["status"] for row in table] == [e["status"] for e in result["entries"]]
    package = tmp_path / "out" / "line.register.gpkg"
    layers = {name: pyogrio.raw.read(package, layer=name) for name in ("assets", "new", "moves")}
    assert {name: len(layer[2]) for name, layer in layers.items()} == {
        "assets": 13, "new": 2, "moves": 10,
    }  # fmt: skip
    assert pyproj.CRS(layers["new"][0]["crs"]).to_epsg() == UNIT
    lengths = shapely.length(shapely.from_wkb(layers["moves"][2]))
    assert sorted(lengths)[-3:] == pytest.approx([np.hypot(2, 2), 4.0, 6.0])


def test_the_summary_for_people_names_what_differs(call, found, register, tmp_path):
    assets = write_rows(tmp_path / "register.csv", ("asset", "x", "y"), register)
    done = call("register", found, "--assets", assets)
    assert done.code == 0
    first = done.out.splitlines()[0]
    assert first.startswith("13 assets, 12 towers: 7 matched, 3 moved more than 2 m, 2 missing")
    assert "moved: asset A5" in done.out and "missing: asset G1" in done.out
    assert "A2" not in done.out
    assert "-0.00" not in done.out and "+0.00 m east" in done.out
    assert done.out.splitlines()[-1] == "nothing was written; name a folder with --out"


def test_longitude_and_latitude_give_the_same(call, found, register, tmp_path):
    there = pyproj.Transformer.from_crs(UNIT, 4326, always_xy=True)
    rows = [(name, *there.transform(x, y)) for name, x, y in register]
    assets = write_rows(tmp_path / "degrees.csv", ("Pole-ID", "Longitude", "Latitude"), rows)
    done = call("register", found / "line.gpkg", "--assets", assets, "--json")
    counts = json.loads(done.out)["counts"]
    assert (counts["moved"], counts["missing"], counts["new"], counts["outside"]) == (3, 2, 2, 1)


@pytest.mark.parametrize("ending", ["gpkg", "shp"])
def test_a_layer_in_another_system_is_converted(call, found, register, tmp_path, ending):
    there = pyproj.Transformer.from_crs(UNIT, 3763, always_xy=True)
    points = [shapely.Point(*there.transform(x, y)) for _, x, y in register]
    path = tmp_path / f"poles.{ending}"
    names = np.array([row[0] for row in register], object)
    places = shapely.to_wkb(np.array(points, object))
    pyogrio.raw.write(path, places, [names], ["pole"], geometry_type="Point", crs="EPSG:3763")
    done = call("register", found, "--assets", path, "--json")
    assert done.code == 0, done.err
    result = json.loads(done.out)
    counts = result["counts"]
    assert (counts["moved"], counts["missing"], counts["new"], counts["outside"]) == (3, 2, 2, 1)
    assert "A1" in by_status(result["entries"], "asset")["moved"]


def test_a_table_of_a_spreadsheet_with_decimal_commas(call, found, register, tmp_path):
    lines = ["Mast Nr;Rechtswert [m];Hochwert [m];Bemerkung"]
    lines += [f'{n};{x:.3f};{y:,.3f};"süd; west"' for n, x, y in register]
    text = "\r\n".join(lines).replace(",", "'").replace(".", ",")
    path = tmp_path / "excel.csv"
    columns = ("--x", "Rechtswert [m]", "--y", "Hochwert [m]", "--id", "Mast Nr")
    for encoding in ("utf-8-sig", "cp1252", "utf-16"):
        path.write_bytes(text.encode(encoding))
        done = call("register", found, "--assets", path, *columns, "--json")
        assert done.code == 0, done.err
        result = json.loads(done.out)
        assert result["counts"]["moved"] == 3 and result["counts"]["missing"] == 2
        assert "A1" in by_status(result["entries"], "asset")["moved"]


def test_without_the_coverage_an_asset_outside_it_counts_as_missing_and_this_is_said(
    call, found, register, tmp_path
):
    alone = tmp_path / "list.csv"
    alone.write_bytes((found / "line.towers.csv").read_bytes())
    assets = write_rows(tmp_path / "register.csv", ("id", "x", "y"), register)
    done = call("register", alone, "--assets", assets, "--json")
    counts = json.loads(done.out)["counts"]
    assert (counts["missing"], counts["outside"]) == (3, 0)
    assert "the coverage of the survey is not known" in done.err


def test_an_asset_without_coordinates_is_listed(call, found, register, tmp_path):
    assets = write_rows(tmp_path / "register.csv", ("id", "x", "y"), [*register, ("Z9", "", "")])
    done = call("register", found, "--assets", assets, "--json")
    result = json.loads(done.out)
    assert by_status(result["entries"], "asset")["without place"] == {"Z9"}
    assert result["counts"]["assets"] == 14


BAD = {
    "empty": ("", "the file is empty"),
    "header": ("id,x,y\n", "there is no asset in it"),
    "columns": ("id,a,b\n1,2,3\n", "no columns with coordinates among id, a, b"),
    "number": ("id,x,y\n1,12,abc\n", "row 2: 'abc' in column 'y' is not a number"),
    "half": ("id,x,y\n1,12,\n", "row 2: it has no y"),
    "twice": ("id,x,y\n7,1,2\n8,1,2\n7,3,4\n", "row 4: the id '7' of column 'id' is also that"),
    "nowhere": ("id,x,y\n1,,\n", "none of its assets has coordinates"),
    "commas": ("id,x,y\n1,500020,5,4630020,5\n", "row 2: it has 5 cells, and the header has 3"),
    "same": ("id,x,x\n1,2,3\n", "two columns have the name 'x'"),
    "far": ("id,x,y\n1,1000,1000\n", "none of the assets is within 10 km of the survey"),
    "degrees": ("id,lon,lat\n1,500020,4630020\n", "row 2: it is not a longitude and latitude"),
    "swapped": ("id,lon,lat\n1,41.8,-190\n", "row 2: it is not a longitude and latitude"),
}


@pytest.mark.parametrize("fault", BAD)
def test_a_fault_of_the_register_is_named(call, found, tmp_path, fault):
    text, message = BAD[fault]
    path = tmp_path / "register.csv"
    path.write_text(text)
    done = call("register", found, "--assets", path, "--out", tmp_path / "out")
    assert done.code == 1
    assert message in done.err
    assert not (tmp_path / "out").exists()


def test_a_column_or_a_layer_that_is_not_there_is_named(call, found, tmp_path):
    path = write_rows(tmp_path / "register.csv", ("id", "x", "y"), [(1, 2, 3)])
    done = call("register", found, "--assets", path, "--x", "X", "--y", "y")
    assert done.code == 1 and "it has no column 'X'; its columns: id, x, y" in done.err
    done = call("register", found, "--assets", path, "--id", "name")
    assert done.code == 1 and "it has no column 'name'" in done.err
    done = call("register", found, "--assets", found / "line.gpkg")
    assert done.code == 1 and "several layers: towers, coverage, tiles" in done.err
    done = call("register", found, "--assets", found / "line.gpkg", "--layer", "tiles")
    assert done.code == 1 and "a tower is a point" in done.err
    done = call("register", found, "--assets", found / "line.laz")
    assert done.code == 1 and "a table is a .csv, .gpkg or .shp file" in done.err
    assert call("register", found, "--assets", path, "--moved", 20).code == 2


def test_what_is_no_tower_list_is_named(call, found, tmp_path):
    assets = write_rows(tmp_path / "register.csv", ("id", "x", "y"), [(1, 2, 3)])
    done = call("register", tmp_path, "--assets", assets)
    assert done.code == 1 and "there is no tower list (*.towers.csv) in it" in done.err
    other = write_rows(tmp_path / "other.csv", ("name", "x", "y"), [(1, 2, 3)])
    done = call("register", other, "--assets", assets)
    assert done.code == 1 and "it has no column id" in done.err
    for name in "ab":
        (tmp_path / f"{name}.towers.csv").write_text("id,x,y\n")
    done = call("register", tmp_path, "--assets", assets)
    assert done.code == 1 and "2 tower lists (a.towers.csv, b.towers.csv)" in done.err
    assert f"such as {tmp_path / 'a.towers.csv'}" in done.err


def test_only_its_own_results_are_replaced(call, found, register, tmp_path):
    assets = write_rows(tmp_path / "register.csv", ("id", "x", "y"), register)
    out = tmp_path / "out"
    compare = ("register", found, "--assets", assets, "--out", out)
    assert [call(*compare).code for _ in range(2)] == [0, 0]
    table = out / "line.register.csv"
    table.write_text("my own notes")
    refused = call(*compare)
    assert refused.code == 1 and "line.register.csv: this file exists" in refused.err
    assert table.read_text() == "my own notes"
    assert call(*compare, "--overwrite").code == 0
    assert "status" in table.read_text()


def test_an_asset_at_its_place_keeps_its_tower():
    """The asset beside it has none; a pairing with more pairs would move both."""
    assets, towers = np.array([[0.0, 0.0], [8.0, 0.0]]), np.array([[0.0, 0.0], [-9.0, 0.0]])
    assert match(assets, towers, 10.0) == [(0, 0)]


@given(
    st.lists(st.tuples(st.integers(0, 12), st.integers(0, 12)), max_size=5, unique=True),
    st.lists(st.tuples(st.integers(0, 12), st.integers(0, 12)), max_size=5, unique=True),
)
def test_no_other_pairing_has_a_smaller_sum_of_distances(assets, towers):
    from itertools import permutations

    a, t = (np.array(each, float).reshape(-1, 2) for each in (assets, towers))
    pairs = match(a, t, 5.0)
    assert len({i for i, _ in pairs}) == len({j for _, j in pairs}) == len(pairs)
    apart = np.minimum(np.hypot(*(a[:, None] - t[None]).transpose(2, 0, 1)), 5.0)
    total = sum(apart[i, j] for i, j in pairs) + 5.0 * (len(a) - len(pairs))
    slots = [*range(len(t)), *[None] * len(a)]
    least = (
        min(
            sum(5.0 if j is None else apart[i, j] for i, j in enumerate(chosen))
            for chosen in set(permutations(slots, len(a)))
        )
        if len(a) <= 3
        else total
    )
    assert total == pytest.approx(least)
