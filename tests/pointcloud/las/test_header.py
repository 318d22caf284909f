"""A header is compared with the file before it is used."""

from __future__ import annotations

import struct
import time

import numpy as np
import pytest

from scenenet.core.errors import InputError
from scenenet.pointcloud import iter_chunks, read, survey_info
from scenenet.pointcloud.las.header import read_header


def refused(path, *words: str) -> InputError:
    with pytest.raises(InputError) as caught:
        read(path)
    assert str(path) in str(caught.value), "the message names the file"
    for word in words:
        assert word in str(caught.value)
    return caught.value


def test_a_header_that_claims_more_points_than_the_file_holds_is_refused(make_las, patched):
    path = patched(make_las(version="1.2", point_format=1, n=100), {107: struct.pack("<I", 1000)})
    error = refused(path, "1000", "100")
    assert error.remedy


def test_a_las_file_cut_off_in_its_points_is_refused_with_both_counts(make_las, patched):
    path = make_las(version="1.2", point_format=1, n=100)
    refused(patched(path, cut=path.stat().st_size - 28), "100", "99")


@pytest.mark.parametrize("size", [1, 3, 4, 100, 226, 300])
def test_a_file_that_ends_inside_its_header_is_refused(make_las, patched, size):
    refused(patched(make_las(), cut=size))


def test_a_billion_claimed_records_cost_no_time(make_las, patched):
    path = patched(make_las(n=50), {100: struct.pack("<I", 1_000_000_000)})
    start = time.perf_counter()
    refused(path, "1000000000")
    assert time.perf_counter() - start < 2


def test_one_record_too_many_is_reported_and_the_points_are_read(make_las, patched):
    path = patched(make_las(n=50, crs="EPSG:32629"), {100: struct.pack("<I", 2)})
    assert len(read(path)) == 50
    assert any("claims 2 variable" in warning for warning in survey_info(path).warnings)


def test_extended_records_that_do_not_fit_are_reported_and_not_read(make_las, patched):
    path = patched(make_las(n=5), {235: struct.pack("<QI", 400, 4_000_000_000)})
    assert any("4000000000" in warning for warning in survey_info(path).warnings)
    assert len(read(path)) == 5


@pytest.mark.parametrize(
    ("at", "word"),
    [
        ({24: b"\x02"}, "LAS 2.4"),
        ({25: b"\x09"}, "LAS 1.9"),
        ({94: struct.pack("<H", 0)}, "did not finish"),
        ({96: struct.pack("<I", 10)}, "byte 10"),
        ({96: struct.pack("<I", 4_000_000_000)}, "4000000000"),
        ({104: b"\x0b"}, "11"),
        ({105: struct.pack("<H", 29)}, "29"),
        ({131: struct.pack("<d", np.nan)}, "scale"),
        ({139: struct.pack("<d", 0.0)}, "scale"),
        ({147: struct.pack("<d", 1e300)}, "scale"),
        ({155: struct.pack("<d", np.inf)}, "offset"),
    ],
)
def test_a_header_that_contradicts_itself_is_refused(make_las, patched, at, word):
    refused(patched(make_las(), at), word)


def test_points_that_the_header_omits_are_reported(make_las, patched):
    path = make_las(version="1.2", point_format=0, n=60)
    refused(patched(path, {107: struct.pack("<I", 0)}), "0 points", "did not finish")
    info = survey_info(patched(path, {107: struct.pack("<I", 40)}))
    assert info.n_points == 40
    assert any("room for 20 points" in warning for warning in info.warnings)


def test_a_count_in_the_older_field_alone_is_refused_and_not_read_as_nothing(make_las, patched):
    path = make_las(point_format=1, n=30)
    refused(
        patched(path, {107: struct.pack("<I", 30), 247: struct.pack("<Q", 0)}), "claims 0 points"
    )


def test_an_impossible_bounding_box_is_a_warning_and_the_points_are_read(make_las, patched):
    path = patched(make_las(n=10), {179: struct.pack("<d", np.nan)})
    assert any("bounding box" in warning for warning in survey_info(path).warnings)
    assert len(read(path)) == 10


def test_empty_and_single_point_surveys_are_surveys(make_las):
    for suffix in ("las", "laz"):
        empty, one = make_las(f"empty.{suffix}", n=0), make_las(f"one.{suffix}", n=1)
        assert len(read(empty)) == 0
        assert list(iter_chunks(empty)) == []
        assert len(read(one, "edp")) == 1


# --- compressed files -------------------------------------------------------------------------


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9, 0.99])
def test_a_truncated_laz_file_is_refused_before_decoding(make_las, patched, share):
    path = make_las("survey.laz", n=2000)
    cut = int(path.stat().st_size * share)
    error = refused(patched(path, cut=cut))
    assert "decoder" not in error.problem


def test_a_laz_header_whose_count_differs_from_the_chunk_table_is_refused(make_las, patched):
    path = make_las("survey.laz", n=2000)
    for count in (120_000, 10**12):
        refused(patched(path, {247: struct.pack("<Q", count)}), str(count), "1 chunks")


def test_a_laz_file_without_the_record_of_its_compression_is_refused(make_las, patched):
    path = make_las("survey.laz")
    at = path.read_bytes().index(b"laszip encoded")
    refused(patched(path, {at: b"no"}), "compressed", "missing")


def test_a_chunk_table_that_asks_for_memory_is_refused(make_las, patched):
    path = make_las("survey.laz", n=2000)
    header = read_header(path)
    table = struct.unpack("<q", path.read_bytes()[header.las.offset_to_point_data :][:8])[0]
    refused(patched(path, {table + 4: struct.pack("<I", 0xFFFFFFF0)}), "chunks")
    refused(patched(path, {table: b"\x07"}), "table")
