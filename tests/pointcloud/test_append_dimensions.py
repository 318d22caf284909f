"""Dimensions are added to a survey, and every byte of it is kept."""

from __future__ import annotations

import struct

import laspy
import numpy as np
import pyproj
import pytest

from scenenet.core.errors import InputError
from scenenet.core.unchanged import FileState
from scenenet.pointcloud import PointCloud, add_dimensions, read, survey_info, write_las
from scenenet.pointcloud.las.header import read_header
from scenenet.pointcloud.las.records import iter_records

NAMES = {"tower_probability": ("f4", "probability"), "tower_id": ("u4", "0: none")}


def values(xyz):
    return {"tower_probability": xyz[:, 2], "tower_id": (xyz[:, 0] * 100).astype(np.int64)}


def records_of(path) -> np.ndarray:
    return np.concatenate([r.array for r in iter_records(read_header(path), 1000)])


def assert_same_but_for_additions(source, target) -> None:
    old, new = read_header(source), read_header(target)
    records, widened = records_of(source), records_of(target)
    assert records.dtype.names + tuple(NAMES) == widened.dtype.names
    for name in records.dtype.names:  # bytes, because NaN is not equal to itself
        assert records[name].tobytes() == widened[name].tobytes(), name
    skipped = {("LASF_Spec", 4), ("laszip encoded", 22204)}
    for vlr in old.vlrs:
        if (vlr.user_id, vlr.record_id) not in skipped:
            assert vlr in new.vlrs
    for field in (
        "file_source_id", "uuid", "version", "system_identifier", "generating_software",
        "creation_date", "extra_header_bytes", "extra_vlr_bytes", "point_count",
    ):  # fmt: skip
        assert getattr(new.las, field) == getattr(old.las, field), field
    assert new.las.global_encoding.value == old.las.global_encoding.value
    for field in ("scales", "offsets", "mins", "maxs"):
        np.testing.assert_array_equal(getattr(new.las, field), getattr(old.las, field))


def assert_same_for_laspy(source, target) -> None:
    old, new = laspy.read(source), laspy.read(target)
    assert old.header.point_format.id == new.header.point_format.id
    for name in old.point_format.dimension_names:
        np.testing.assert_array_equal(old[name], new[name], err_msg=name)
    np.testing.assert_array_equal(new.tower_id, (np.asarray(old.x) * 100).astype(np.int64))
    np.testing.assert_array_equal(new.tower_probability, np.asarray(old.z).astype("f4"))


@pytest.mark.parametrize("suffix", ["las", "laz"])
@pytest.mark.parametrize("point_format", range(11))
def test_every_point_format_keeps_every_dimension(make_las, tmp_path, point_format, suffix):
    version = "1.2" if point_format < 4 else "1.3" if point_format < 6 else "1.4"
    source = make_las(f"in.{suffix}", version=version, point_format=point_format, n=3000)
    target = tmp_path / "out.laz"
    assert add_dimensions(source, target, NAMES, values) == 3000
    assert_same_but_for_additions(source, target)
    assert_same_for_laspy(source, target)


def test_existing_extra_dimensions_keep_names_types_and_values(make_las, tmp_path):
    existing = {"amplitude": "u2", "normal": "3f8", "height above ground": "f4"}
    source, target = make_las("in.laz", extra=existing), tmp_path / "out.laz"
    add_dimensions(source, target, NAMES, values)
    assert_same_for_laspy(source, target)
    assert survey_info(target).extra_dimensions == (*existing, *NAMES)
    description = laspy.read(target).point_format.dimension_by_name("amplitude").description
    assert description == "existing"


def test_the_coordinate_system_and_the_scale_stay(make_las, tmp_path):
    source = make_las("in.laz", crs=pyproj.CRS.from_epsg(28992), scale=0.0005)
    target = tmp_path / "out.laz"
    add_dimensions(source, target, NAMES, values)
    assert survey_info(target).crs.to_epsg() == 28992
    assert survey_info(target).scales == (0.0005,) * 3


def test_a_predicted_survey_can_be_predicted_again(make_las, tmp_path):
    source, once, twice = make_las("in.laz"), tmp_path / "once.laz", tmp_path / "twice.laz"
    older = NAMES | {"share_old_kernel": "f4"}
    add_dimensions(source, once, older, lambda x: values(x) | {"share_old_kernel": x[:, 0]})
    add_dimensions(once, twice, NAMES, values)
    assert survey_info(twice).extra_dimensions == tuple(NAMES)
    assert_same_for_laspy(source, twice)
    add_dimensions(twice, twice, NAMES, values)
    assert_same_for_laspy(source, twice)


def test_dimensions_of_a_written_cloud_are_not_taken_for_predictions(tmp_path):
    source, target = tmp_path / "in.laz", tmp_path / "out.laz"
    cloud = PointCloud(np.zeros((5, 3)), np.zeros(5, np.uint8))
    write_las(source, cloud, extra={"truth": np.arange(5, dtype="u1")})
    add_dimensions(source, target, NAMES, values)
    np.testing.assert_array_equal(laspy.read(target).truth, np.arange(5))


def test_an_existing_dimension_with_a_reserved_name_is_refused(make_las, tmp_path):
    source = make_las("in.laz", extra={"tower_id": "u2"})
    with pytest.raises(InputError, match="tower_id"):
        add_dimensions(source, tmp_path / "out.laz", NAMES, values)
    assert not (tmp_path / "out.laz").exists()


def test_extended_records_are_kept(make_las, tmp_path):
    source = make_las("in.laz")
    with laspy.open(source) as reader:
        points, header = reader.read().points, reader.header
    evlrs = [laspy.VLR("someone", 7, "large", bytes(range(256)) * 400)]
    with laspy.open(source, mode="w", header=header) as writer:
        writer.write_points(points)
        writer.write_evlrs(laspy.vlrs.vlrlist.VLRList(evlrs))
    target = tmp_path / "out.laz"
    add_dimensions(source, target, NAMES, values)
    assert laspy.read(target).evlrs[0].record_data == evlrs[0].record_data
    assert_same_for_laspy(source, target)


def test_extended_records_that_laspy_interprets_come_back_as_bytes(make_las, tmp_path):
    """Class names in fields of 15 bytes, which a writer need not pad with zeros."""
    source, target = make_las("in.laz"), tmp_path / "out.laz"
    names = [(2, b"ground (bare)\0X"), (15, b"tower (noise?)!"), (18, b"high\0(noisy)\0rest")]
    lookup = b"".join(struct.pack("<B15s", code, name) for code, name in names)
    data = bytearray(source.read_bytes())
    struct.pack_into("<QI", data, 235, len(data), 2)
    for user, number, content in ((b"LASF_Spec", 0, lookup), (b"LASF_Spec", 3, b"text\0\1\2")):
        data += struct.pack("<2x16sHQ32s", user, number, len(content), b"names") + content
    source.write_bytes(data)
    before = read_header(source).evlrs
    assert before[0].data == lookup
    add_dimensions(source, target, NAMES, values)
    assert read_header(target).evlrs == before
    assert_same_for_laspy(source, target)


@pytest.mark.parametrize("how", ["replaced", "overwritten", "removed"])
@pytest.mark.parametrize("name", ["in.las", "in.laz", "in.npy"])
def test_a_survey_that_changes_meanwhile_leaves_the_earlier_result(make_las, tmp_path, name, how):
    source, target = tmp_path / name, tmp_path / "out.laz"
    if source.suffix == ".npy":
        other = tmp_path / "other.npy"
        np.save(source, np.ones((100, 4)))
        np.save(other, np.zeros((100, 4)))
    else:
        other = make_las(f"other{source.suffix}", seed=1)
        make_las(name)
    target.write_bytes(b"the earlier result")
    state = FileState.of(source)

    def change(xyz):
        if how == "removed":
            source.unlink(missing_ok=True)
        elif how == "replaced" and other.exists():
            other.replace(source)
        elif how == "overwritten" and other.exists():
            source.write_bytes(other.read_bytes())
            other.unlink()
        raise IndexError("what a look-up of other points raises")

    for change_when, act in (("during", change), ("before", values)):
        with pytest.raises(InputError, match=r"changed, replaced or removed") as caught:
            add_dimensions(source, target, NAMES, act, state)
        assert name in str(caught.value), change_when
        assert target.read_bytes() == b"the earlier result"
        assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def test_undescribed_extra_bytes_are_kept(make_las, tmp_path, patched):
    source = make_las("in.las", extra={"mystery": "u4"})
    at = source.read_bytes().index(b"LASF_Spec")
    source = patched(source, {at: b"LASF_Gone"})
    assert survey_info(source).extra_dimensions == ("ExtraBytes",)
    target = tmp_path / "out.laz"
    add_dimensions(source, target, NAMES, values)
    assert_same_for_laspy(source, target)


@pytest.mark.parametrize("count", [8, 13, 300])
def test_many_undescribed_extra_bytes_are_kept_in_pieces(make_las, tmp_path, patched, count):
    extra = {f"mystery {at}": f"{min(count - at, 3)}u1" for at in range(0, count, 3)}
    source, target = make_las("in.las", n=20, extra=extra), tmp_path / "out.laz"
    source = patched(source, {source.read_bytes().index(b"LASF_Spec"): b"LASF_Gone"})
    add_dimensions(source, target, NAMES, values)
    old, new = laspy.read(source), laspy.read(target)
    pieces = [n for n in new.point_format.extra_dimension_names if n not in NAMES]
    whole = np.column_stack([new[name] for name in pieces])
    np.testing.assert_array_equal(whole, old["ExtraBytes"])
    np.testing.assert_array_equal(new.tower_probability, np.asarray(old.z).astype("f4"))


def test_waveforms_inside_of_the_file_are_refused_and_not_lost(make_las, tmp_path, patched):
    source = make_las("in.las", version="1.3", point_format=4, n=10)
    packet = struct.pack("<2x16sHQ32s", b"LASF_Spec", 65535, 80, b"waveforms") + bytes(range(80))
    source = patched(source, {227: struct.pack("<Q", source.stat().st_size)}, add=packet)
    assert any("no prediction" in warning for warning in survey_info(source).warnings)
    assert len(read(source)) == 10
    target = tmp_path / "out.laz"
    with pytest.raises(InputError, match="waveforms"):
        add_dimensions(source, target, NAMES, values)
    assert not target.exists()


@pytest.fixture
def make_channels(make_las):
    def make(point_format: int):
        source = make_las("in.las", point_format=point_format, n=500)
        las = laspy.read(source)
        las.scanner_channel = np.arange(500) % 4
        las.write(source)
        return source

    return make


def test_several_scanner_channels_are_kept(make_channels, tmp_path):
    source, target = make_channels(7), tmp_path / "out.laz"
    add_dimensions(source, target, NAMES, values)
    assert_same_but_for_additions(source, target)


@pytest.mark.parametrize("point_format", [9, 10])
def test_waveform_packets_of_several_channels_are_not_compressed_to_nonsense(
    make_channels, tmp_path, point_format
):
    source = make_channels(point_format)
    with pytest.raises(InputError, match="scanner channels"):
        add_dimensions(source, tmp_path / "out.laz", NAMES, values)
    assert not (tmp_path / "out.laz").exists()
    add_dimensions(source, tmp_path / "out.las", NAMES, values)
    assert_same_but_for_additions(source, tmp_path / "out.las")


def test_the_no_data_value_of_existing_dimensions_is_kept(make_las, tmp_path, patched):
    source = make_las("in.laz", extra={"amplitude": "u2"})
    at = source.read_bytes().index(b"amplitude") - 4  # where its description begins
    changes = {at + 3: b"\x01", at + 40: struct.pack("<Q", 65535)}  # the value for "no data"
    source, target = patched(source, changes), tmp_path / "out.laz"
    add_dimensions(source, target, NAMES, values)
    data = target.read_bytes()
    new = data.index(b"amplitude") - 4
    assert data[new + 3] & 0x01
    assert data[new + 40 : new + 48] == struct.pack("<Q", 65535)


def test_no_dimension_has_the_bounds_of_another(make_las, tmp_path):
    source, target = make_las("in.laz", extra={"amplitude": "u2", "normal": "3f8"}), "out.laz"
    add_dimensions(source, tmp_path / target, NAMES, values)
    las = laspy.read(tmp_path / target)
    for entry in las.header.vlrs.get("ExtraBytesVlr")[0].extra_bytes_structs:
        assert entry.min is None
        assert entry.max is None


def test_records_that_laspy_interprets_come_back_as_bytes(make_las, tmp_path):
    source, target = make_las("in.las"), tmp_path / "out.laz"
    las = laspy.read(source)
    lookup = struct.pack(
        "<B15s", 15, b"Tower (steel)."
    )  # laspy drops characters other than letters and digits
    las.header.vlrs.append(laspy.VLR("LASF_Spec", 0, "classes", lookup))
    las.header.vlrs.append(laspy.VLR("LASF_Projection", 2112, "WKT", b'LOCAL_CS["site"]\0\0\0'))
    las.write(source)
    add_dimensions(source, target, NAMES, values)
    assert {lookup, b'LOCAL_CS["site"]\0\0\0'} <= {v.data for v in read_header(target).vlrs}


@pytest.mark.parametrize(("point_format", "minor", "comes_back"), [(1, 0, "1.2"), (3, 1, "1.2")])
def test_a_version_that_laspy_does_not_write_comes_back_as_the_next(
    make_las, tmp_path, patched, point_format, minor, comes_back
):
    source = make_las("in.las", version="1.2", point_format=point_format)
    source, target = patched(source, {25: bytes([minor])}), tmp_path / "out.laz"
    add_dimensions(source, target, NAMES, values)
    assert survey_info(target).version == comes_back
    assert_same_for_laspy(source, target)


def test_text_that_cannot_be_written_is_refused_and_nothing_written(make_las, tmp_path, patched):
    source = make_las("in.las", crs="EPSG:32629")
    at = source.read_bytes().index(b"LASF_Projection")
    source = patched(source, {at: "é".encode()})
    assert len(read(source)) == 100
    with pytest.raises(InputError, match="ASCII"):
        add_dimensions(source, tmp_path / "out.laz", NAMES, values)
    assert not (tmp_path / "out.laz").exists()


def test_an_empty_survey_stays_empty(make_las, tmp_path):
    for suffix in ("las", "laz"):
        source = make_las(f"in.{suffix}", n=0)
        assert add_dimensions(source, tmp_path / "out.laz", NAMES, values) == 0
        assert len(laspy.read(tmp_path / "out.laz").points) == 0


def test_chunks_come_in_order_and_cover_the_survey(make_las, tmp_path, monkeypatch):
    monkeypatch.setattr("scenenet.pointcloud.append_dimensions.CHUNK_POINTS", 300)
    source, seen = make_las("in.las", n=1000), []

    def count(xyz):
        seen.append(xyz)
        return values(xyz)

    add_dimensions(source, tmp_path / "out.laz", NAMES, count)
    assert [len(xyz) for xyz in seen] == [300, 300, 300, 100]
    np.testing.assert_array_equal(np.concatenate(seen), laspy.read(source).xyz)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda xyz: {"tower_id": np.zeros(len(xyz), int)},
        lambda xyz: {"tower_id": np.zeros(3, int), "tower_probability": np.zeros(3)},
        lambda xyz: {"tower_id": -np.ones(len(xyz), int), "tower_probability": xyz[:, 0]},
        lambda xyz: {"tower_id": xyz[:, 0] + 0.5, "tower_probability": xyz[:, 0]},
    ],
)
def test_values_that_do_not_fit_are_refused_and_nothing_written(make_las, tmp_path, wrong):
    target = tmp_path / "out.laz"
    with pytest.raises(ValueError):
        add_dimensions(make_las("in.laz"), target, NAMES, wrong)
    assert not target.exists()


def test_a_damaged_survey_leaves_no_output(make_las, tmp_path, patched):
    source = make_las("in.laz", n=2000)
    at = read_header(source).las.offset_to_point_data + 200
    damaged = patched(source, {at: bytes(range(256)) * 4, at + 5000: b"\xff" * 9000})
    target = tmp_path / "out.laz"
    try:
        add_dimensions(damaged, target, NAMES, values)
    except InputError:
        assert not target.exists()


def test_a_real_corridor_comes_back_field_by_field(real_data, tmp_path):
    source, target = real_data / "corridor" / "07CZ2_14.laz", tmp_path / "out.laz"
    add_dimensions(source, target, NAMES, values)
    assert_same_but_for_additions(source, target)
    assert_same_for_laspy(source, target)
