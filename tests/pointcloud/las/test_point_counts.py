"""Every read ends with as many points as the file holds and its header claims, or in an error."""

from __future__ import annotations

import os
import struct
from pathlib import Path

import laspy
import numpy as np
import pytest

from scenenet.core.errors import InputError
from scenenet.pointcloud import PointCloud, iter_chunks, read, survey_info, write_las
from scenenet.pointcloud.las.header import read_header

LEGACY_COUNT, COUNT = 107, 247
LEGACY_RETURNS, RETURNS = 111, 255


def claiming(path: Path, count: int, *, returns: bool = False) -> dict[int, bytes]:
    """The bytes of a header that claims ``count`` points; with ``returns``, also by return."""
    head = path.read_bytes()[:375]
    legacy = struct.unpack_from("<I", head, LEGACY_COUNT)[0]
    new = {LEGACY_COUNT: struct.pack("<I", count)} if legacy else {}
    if head[25] >= 4:
        new[COUNT] = struct.pack("<Q", count)
    if returns:
        new[LEGACY_RETURNS] = struct.pack("<5I", count if legacy else 0, 0, 0, 0, 0)
        if head[25] >= 4:
            new[RETURNS] = struct.pack("<15Q", count, *[0] * 14)
    return new


@pytest.mark.parametrize("returns", [False, True])
@pytest.mark.parametrize("count", [500, 999, 1001, 1])
@pytest.mark.parametrize(
    ("version", "point_format"), [("1.2", 0), ("1.2", 3), ("1.3", 4), ("1.4", 1), ("1.4", 7)]
)
def test_a_laz_file_with_a_wrong_count_is_refused(
    make_las, patched, version, point_format, count, returns
):
    path = make_las("in.laz", version=version, point_format=point_format, n=1000)
    assert len(read(path)) == 1000
    with pytest.raises(InputError, match=f"{count}") as caught:
        read(patched(path, claiming(path, count, returns=returns)))
    assert "in.laz" in str(caught.value)


def write_equal_points(path: Path, n: int) -> None:
    """Points that compress to almost nothing: chunk sizes say little about their number."""
    header = laspy.LasHeader(version="1.2", point_format=1)
    las = laspy.LasData(header)
    las.points = laspy.ScaleAwarePointRecord.zeros(n, header=header)
    las.return_number = las.number_of_returns = np.ones(n, int)
    las.write(path)


@pytest.mark.parametrize("count", [500, 990])
def test_the_points_by_return_count_where_the_bytes_say_little(tmp_path, patched, count):
    path = tmp_path / "equal.laz"
    write_equal_points(path, 1000)
    assert len(read(path)) == 1000
    with pytest.raises(InputError, match="the file holds more"):
        read(patched(path, claiming(path, count)))


@pytest.mark.parametrize("point_format", [1, 6])
def test_stale_points_by_return_are_a_warning_if_the_chunks_agree_with_the_count(
    make_las, patched, point_format
):
    path = make_las("in.laz", version="1.4", point_format=point_format, n=1000)
    stale = patched(path, {RETURNS: struct.pack("<15Q", 900, 400, *[0] * 13)})
    assert len(read(stale)) == 1000
    assert any("sum to 1300" in text for text in survey_info(stale).warnings)


def test_two_counts_that_differ_are_a_warning(make_las, patched):
    path = make_las("in.laz", version="1.4", point_format=1, n=1000)
    odd = patched(path, {LEGACY_COUNT: struct.pack("<I", 700)})
    assert len(read(odd)) == 1000
    assert any("700 in the field of LAS 1.3" in text for text in survey_info(odd).warnings)


@pytest.mark.parametrize("n", [50_000, 50_001, 100_000])
@pytest.mark.parametrize("point_format", [1, 6])
def test_full_chunks_and_a_chunk_of_one_point_are_read(make_las, n, point_format):
    path = make_las("in.laz", version="1.4", point_format=point_format, n=n)
    assert len(read(path)) == n


def test_a_las_file_with_room_and_returns_for_more_is_refused(tmp_path, patched):
    path = tmp_path / "equal.las"
    write_equal_points(path, 1000)
    with pytest.raises(InputError, match=r"room for 1000.*sum to 1000"):
        read(patched(path, claiming(path, 500)))
    with pytest.raises(InputError, match="claims 0 points, but 28000 bytes follow"):
        read(patched(path, claiming(path, 0)))
    single = tmp_path / "single.las"
    write_equal_points(single, 1)
    with pytest.raises(InputError, match=r"room for 1, .*sum to 1"):
        read(patched(single, claiming(single, 0)))
    warned = survey_info(patched(path, claiming(path, 500, returns=True))).warnings
    assert any("room for 500 points, which are not read" in text for text in warned)


# --- COPC -------------------------------------------------------------------------------------


@pytest.fixture
def make_copc(make_las, tmp_path):
    """Writes a COPC file of one octree cell, and says where its entry is."""

    def make(n: int = 1000, entry_points: int | None = None, pages: int = 0) -> Path:
        laz = make_las("plain.laz", version="1.4", point_format=7, n=n)
        header = read_header(laz)
        data = bytearray(laz.read_bytes())
        added = 54 + 160
        start, points = header.las.offset_to_point_data, len(data)
        info_at = struct.unpack_from("<H", data, 94)[0]
        page_at = points + added + 60
        cell = struct.pack("<4iQ2i", 0, 0, 0, 0, start + added + 8, 9, entry_points or n)
        for _ in range(pages):  # each page points to the next
            cell = struct.pack("<4iQ2i", 0, 0, 0, 0, page_at + 32, 32, -1) + cell
        info = bytearray(160)
        struct.pack_into("<QQ", info, 40, page_at, 32)
        record = struct.pack("<H16sHH32s", 0, b"copc", 1, 160, b"") + bytes(info)
        extended = struct.pack("<H16sHQ32s", 0, b"copc", 1000, len(cell), b"") + cell
        data[info_at:info_at] = record
        struct.pack_into("<I", data, 96, start + added)
        struct.pack_into("<I", data, 100, struct.unpack_from("<I", data, 100)[0] + 1)
        struct.pack_into("<QI", data, 235, points + added, 1)
        at = start + added
        struct.pack_into("<q", data, at, struct.unpack_from("<q", data, at)[0] + added)
        path = tmp_path / "in.copc.laz"
        path.write_bytes(bytes(data) + extended)
        return path

    return make


@pytest.mark.parametrize("pages", [0, 1])
def test_the_cells_of_an_octree_must_have_all_points(make_copc, patched, pages):
    path = make_copc(pages=pages)
    assert read_header(path).format == "copc"
    assert len(read(path)) == 1000
    with pytest.raises(
        InputError, match="claims 500 points, but the cells of its octree have 1000"
    ):
        read(patched(path, claiming(path, 500)))
    with pytest.raises(
        InputError, match="claims 1000 points, but the cells of its octree have 400"
    ):
        read(make_copc(entry_points=400, pages=pages))


def test_an_octree_outside_the_file_is_refused(make_copc, patched):
    path = make_copc()
    at = struct.unpack_from("<H", path.read_bytes(), 94)[0] + 54 + 40
    with pytest.raises(InputError, match="octree should be at byte"):
        read(patched(path, {at: struct.pack("<Q", 2**40)}))


# --- real files -------------------------------------------------------------------------------


def zoo() -> list[Path]:
    """Real files of every program, with more than one point; none where there is no zoo."""
    root = Path(__file__).resolve().parents[4] / "shared" / "data"
    folder = Path(os.environ.get("SCENENET_REAL_DATA", root)) / "zoo"
    return sorted(path for path in folder.glob("*.la[sz]") if path.stat().st_size > 500)


@pytest.mark.parametrize("path", zoo() or [None], ids=lambda path: path and path.name)
def test_a_real_file_with_half_its_count_is_refused_or_warned_about(path, patched):
    if path is None:
        pytest.skip("no real recordings here: set SCENENET_REAL_DATA to a folder that has them")
    try:
        n = survey_info(path).n_points
    except InputError:
        pytest.skip("this file is refused as it is")
    if n < 2:
        pytest.skip("half of it would be no points")
    half = patched(path, claiming(path, n // 2))
    try:
        points = len(read(half))
    except InputError as error:
        assert str(half) in str(error)
    else:
        assert path.suffix == ".las", "a compressed file says how many points it has"
        assert points == n // 2
        assert any("which are not read" in text for text in survey_info(half).warnings)


def test_layers_longer_than_their_chunk_are_refused_before_memory_is_taken(tmp_path):
    path = tmp_path / "survey.laz"
    xyz = np.random.default_rng(0).uniform(0, 50, (2000, 3))
    write_las(path, PointCloud(xyz, np.full(2000, 2, np.uint8)))
    with laspy.open(path) as reader:
        at = reader.header.offset_to_point_data + 8 + reader.header.point_format.size + 4
    damaged = bytearray(path.read_bytes())
    damaged[at : at + 4] = (3_800_000_000).to_bytes(4, "little")
    path.write_bytes(damaged)
    with pytest.raises(InputError, match=r"layers of 38.* bytes in a chunk of"):
        list(iter_chunks(path))
