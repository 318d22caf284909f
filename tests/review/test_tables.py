"""Tables as spreadsheets and map programs write them."""

from __future__ import annotations

import math

import numpy as np
import pyogrio
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from scenenet.core.errors import InputError
from scenenet.review.found_list import FoundList, ListedTower
from scenenet.review.register.assets import Assets
from scenenet.review.register.compare import compare
from scenenet.review.tables.cells import number_of, whole_number_of
from scenenet.review.tables.table import read_table

FOOT = 0.3048


@pytest.mark.parametrize(
    "text, number",
    [
        ("4630020.5", 4630020.5), ("4630020,5", 4630020.5), ("4.630.020,5", 4630020.5),
        ("4,630,020.5", 4630020.5), ("4 630 020,5", 4630020.5), ("4'630'020.5", 4630020.5),
        ("4.630.020", 4630020), ("4,630,020", 4630020), ("-8,61", -8.61), ("1,5E+03", 1500),
        ("", None), ("  ", None), (None, None), (math.nan, None), (7, 7), (7.5, 7.5),
    ],
)  # fmt: skip
def test_numbers_of_different_countries(text, number):
    assert number_of(text) == number


@pytest.mark.parametrize(
    "text", ["abc", "1.2.3,4,5", "12 m", "1e999", "nan", "--1", "0x10", ".", "1 2", "12,34,567"]
)
def test_what_is_no_number_is_refused(text):
    with pytest.raises(ValueError):
        number_of(text)


@given(st.floats(-1e7, 1e7), st.sampled_from(["{:.3f}", "{:,.3f}"]))
def test_a_number_with_decimal_commas_is_the_same(value, form):
    text = form.format(value)
    swapped = text.translate(str.maketrans({",": ".", ".": ","}))
    assert number_of(text) == number_of(swapped) == pytest.approx(value, abs=1e-3)


def test_whole_numbers_may_be_stored_as_real_ones():
    assert whole_number_of("1000263002,0") == whole_number_of(1000263002.0) == 1000263002
    with pytest.raises(ValueError):
        whole_number_of("1.5")


@pytest.mark.parametrize(
    "data",
    [
        b"id,x\n1,2\n", b"\xef\xbb\xbfid,x\r\n1,2\r\n", b"sep=;\nid;x\n1;2\n", b"id\tx\n1\t2\n",
        "id;x;\n1;2;\n".encode("utf-16"), b'id;x\n\n"1";"2"\n;\n', b"id,x\r1,2\r",
    ],
)  # fmt: skip
def test_csv_files_of_different_programs(tmp_path, data):
    path = tmp_path / "a.csv"
    path.write_bytes(data)
    table = read_table(path)
    assert table.columns == ("id", "x")
    assert [(row.text("id"), row.number("x")) for row in table.rows] == [("1", 2.0)]


def test_rows_are_counted_as_a_spreadsheet_counts_them(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text('id,note\n1,"two\nlines"\n\n2,a\n')
    assert [row.place for row in read_table(path).rows] == ["row 2", "row 4"]


@pytest.mark.parametrize("name", ["a.gpkg", "a.shp", "a.csv"])
def test_a_file_of_another_kind_is_named(tmp_path, name):
    path = tmp_path / name
    path.write_bytes(b"PK\x03\x04\x00\x00 no table")
    with pytest.raises(InputError, match=rf"{name}: "):
        read_table(path)
    with pytest.raises(InputError, match="there is no such file"):
        read_table(tmp_path / "none.csv")
    with pytest.raises(InputError, match="this is a folder"):
        read_table(tmp_path)


def test_a_shapefile_without_system_and_with_an_empty_point(tmp_path):
    path = tmp_path / "poles.shp"
    places = np.array([shapely.Point(1, 2), None], object)
    names = np.array(["é", "b"], object)
    with pytest.warns(UserWarning, match="'crs' was not provided"):
        pyogrio.raw.write(path, shapely.to_wkb(places), [names], ["pole"], geometry_type="Point")
    table = read_table(path)
    assert table.crs is None and table.has_points
    assert [(row.text("pole"), row.point) for row in table.rows] == [("é", (1.0, 2.0)), ("b", None)]


def test_distances_of_a_survey_in_feet_are_in_metres(tmp_path):
    towers = tuple(ListedTower(n, x, 0.0, {}) for n, x in ((1, 0.0), (2, 1000.0)))
    found = FoundList(
        tmp_path / "a.csv", "a", {}, towers, unit_sizes=(FOOT, FOOT, FOOT),
        unit_names=("foot",) * 3,
    )  # fmt: skip
    assets = Assets(tmp_path / "r.csv", ("a", "b"), np.array([[10.0, 0.0], [1040.0, 0.0]]), ())
    moved, new = (compare(found, assets, 10.0, 2.0).entries[n] for n in (1, 2))
    assert (moved.status, moved.asset) == ("moved", "a")
    assert moved.distance_m == pytest.approx(10 * FOOT)
    assert (moved.east_m, new.status, new.tower) == (pytest.approx(-10 * FOOT), "new", 2)
