"""Reading: every format gives the points that an independent reader gives."""

from __future__ import annotations

import laspy
import numpy as np
import pyproj
import pytest

from scenenet.core.errors import InputError
from scenenet.pointcloud import iter_chunks, read, survey_info

FORMATS_BY_VERSION = [
    *(("1.1", f) for f in range(2)),
    *(("1.2", f) for f in range(4)),
    *(("1.3", f) for f in range(6)),
    *(("1.4", f) for f in range(11)),
]


@pytest.mark.parametrize("suffix", ["las", "laz"])
@pytest.mark.parametrize(("version", "point_format"), FORMATS_BY_VERSION)
def test_every_point_format_gives_the_coordinates_and_codes_of_laspy(
    make_las, version, point_format, suffix
):
    path = make_las(f"survey.{suffix}", version=version, point_format=point_format, n=300)
    cloud, peer = read(path, "asprs"), laspy.read(path)
    np.testing.assert_array_equal(cloud.xyz, np.column_stack([peer.x, peer.y, peer.z]))
    np.testing.assert_array_equal(cloud.classification, np.asarray(peer.classification))
    assert cloud.xyz.dtype == np.float64
    info = survey_info(path)
    assert (info.version, info.point_format, info.format) == (version, point_format, suffix)


def test_flags_in_the_class_byte_of_old_formats_are_not_part_of_the_class(make_las, patched):
    path = make_las(version="1.2", point_format=0, n=1)
    start = path.stat().st_size - 20
    flagged = patched(path, {start + 15: bytes([0b1110_1111])})
    assert read(flagged).classification.tolist() == [15]


@pytest.mark.parametrize("suffix", ["las", "laz"])
@pytest.mark.parametrize("chunk_points", [1, 7, 999, 1000, 1001])
def test_chunks_are_the_survey_cut_in_order(make_las, suffix, chunk_points):
    n = 60 if chunk_points == 1 else 1000
    path = make_las(f"survey.{suffix}", n=n)
    chunks = list(iter_chunks(path, "edp", chunk_points))
    assert all(len(chunk) == chunk_points for chunk in chunks[:-1])
    whole = read(path)
    np.testing.assert_array_equal(np.concatenate([c.xyz for c in chunks]), whole.xyz)
    codes = np.concatenate([c.classification for c in chunks])
    np.testing.assert_array_equal(codes, whole.classification)


def test_a_chunk_may_hold_several_compressed_pieces_and_cut_them(make_las):
    path = make_las("survey.laz", n=450_000)
    sizes = [len(chunk) for chunk in iter_chunks(path, chunk_points=330_000)]
    assert sizes == [330_000, 120_000]
    peer = laspy.read(path)
    np.testing.assert_array_equal(read(path).xyz[:, 0], np.asarray(peer.x))


def test_a_chunk_is_not_overwritten_by_the_next(make_las):
    chunks = iter_chunks(make_las("survey.laz", n=100), chunk_points=50)
    first = next(chunks)
    kept = first.xyz.copy()
    next(chunks)
    np.testing.assert_array_equal(first.xyz, kept)


def test_the_coordinate_system_comes_from_the_file(make_las):
    for version, point_format in (("1.2", 1), ("1.4", 6)):
        crs = pyproj.CRS.from_epsg(32629)
        path = make_las(version=version, point_format=point_format, crs=crs, n=3)
        assert read(path).crs.to_epsg() == 32629
        assert survey_info(path).crs.to_epsg() == 32629
    assert read(make_las(n=3)).crs is None


def test_a_broken_coordinate_system_is_a_warning_and_not_a_crash(make_las, patched):
    path = make_las(crs=pyproj.CRS.from_epsg(32629), n=3)
    at = path.read_bytes().index(b"PROJCRS")
    broken = patched(path, {at: b"NONSENS"})
    assert read(broken).crs is None
    assert any("coordinate system" in warning for warning in survey_info(broken).warnings)


def test_extra_dimensions_are_named_by_the_info(make_las):
    path = make_las(extra={"height": "f4", "normal": "3f8"})
    assert survey_info(path).extra_dimensions == ("height", "normal")


# --- what is not a survey ---------------------------------------------------------------------


def test_a_missing_file_is_reported_with_similar_names(make_las):
    path = make_las("corridor_14.laz")
    with pytest.raises(InputError, match=r"corridor_14\.laz") as caught:
        read(path.with_name("coridor_14.laz"))
    assert "Did you mean" in caught.value.remedy
    with pytest.raises(InputError) as caught:  # the ending alone makes no name similar
        read(path.with_name("nix.laz"))
    assert caught.value.remedy == "Check the path"


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.laz", b"", "empty"),
        ("a.laz", b"version https://git-lfs.github.com/spec/v1\n", "git lfs pull"),
        ("a.las", b"<html><body>404", "web page"),
        ("a.laz", b"\x1f\x8b\x08rest", "gzip"),
        ("a.las", b"\x93NUMPY\x01\x00", "numpy"),
        ("a.npy", b"LASF" + bytes(400), "LAS"),
        ("a.txt", b"1 2 3\n", "suffix"),
        ("a.las", b"some text", "neither LAS"),
    ],
)
def test_a_file_of_another_kind_is_refused_by_name(tmp_path, name, content, words):
    path = tmp_path / name
    path.write_bytes(content)
    for reader in (read, survey_info, iter_chunks):
        with pytest.raises(InputError, match=words) as caught:
            reader(path)
        assert str(path) in str(caught.value)


def test_a_folder_is_not_a_survey(tmp_path):
    with pytest.raises(InputError, match="folder"):
        read(tmp_path)


def test_an_unknown_class_scheme_is_refused_with_the_known_ones(make_las):
    with pytest.raises(InputError, match="edp, asprs"):
        iter_chunks(make_las(), "aspr")


def test_codes_without_a_scheme_have_no_meaning(make_las):
    with pytest.raises(InputError, match="codes"):
        _ = read(make_las()).is_tower
