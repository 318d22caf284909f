"""The system that a user names counts where a file states none, and never overrides one."""

from __future__ import annotations

import struct

import laspy
import numpy as np
import pyproj
import pytest

from scenenet.core.errors import InputError
from scenenet.pointcloud import PointCloud, add_dimensions, survey_info, write_las
from scenenet.pointcloud.las.crs import same_system
from scenenet.pointcloud.las.header import read_header
from scenenet.pointcloud.quality.check import check_survey
from scenenet.pointcloud.reading import survey_of_lengths

UTM = pyproj.CRS(32629)
FEET = pyproj.CRS("EPSG:2992")
HEIGHTS_IN_FEET = pyproj.CRS("EPSG:32629+6360")
NAMES = {"tower_id": ("u4", "0: none")}


def with_record(path, *records: laspy.VLR):
    las = laspy.read(path)
    las.header.vlrs.extend(records)
    las.write(path)
    return path


def wkt(text: str) -> laspy.VLR:
    return laspy.VLR("LASF_Projection", 2112, "WKT", text.encode() + b"\0")


def copy(source, target, crs):
    add_dimensions(
        source, target, NAMES, lambda xyz: {"tower_id": np.zeros(len(xyz), int)}, crs=crs
    )
    return target


@pytest.mark.parametrize("given", [UTM, FEET, HEIGHTS_IN_FEET])
def test_a_file_without_a_system_takes_the_given_one(make_las, given):
    source = make_las()
    info = survey_of_lengths(source, given)
    assert info.crs == given
    assert info.unit_sizes == survey_info(write_with(source, given)).unit_sizes
    assert survey_info(source).crs is None
    report = check_survey(source, crs=given)
    assert report.facts.crs == given.name
    assert any(f"taken to be in {given.name}, as given" in text for text in report.warnings)
    assert not any("taken to be in metres" in text for text in report.warnings)


def write_with(source, crs):
    """The same points in a file with a system."""
    las = laspy.read(source)
    target = source.with_name("with.las")
    xyz = np.column_stack([las.x, las.y, las.z])
    write_las(target, PointCloud(xyz, np.asarray(las.classification), crs=crs), scale=0.01)
    return target


@pytest.mark.parametrize("version", ["WKT1_GDAL", "WKT1_ESRI", "WKT2_2019"])
@pytest.mark.parametrize("code", [32629, 3035, 2992])
def test_a_file_that_states_the_same_system_is_as_without_the_option(make_las, version, code):
    crs = pyproj.CRS(code)
    stated = with_record(make_las(), wkt(crs.to_wkt(version)))
    assert survey_info(stated, crs).record == survey_info(stated).record
    assert same_system(survey_info(stated).crs, crs)


@pytest.mark.parametrize(
    ("text", "given", "words"),
    [
        (
            UTM.to_wkt(),
            pyproj.CRS(32630),
            "UTM zone 29N, and the system given for it is WGS 84 / UTM zone 30N",
        ),
        (FEET.to_wkt(), pyproj.CRS(2991), "given for it is"),
        (HEIGHTS_IN_FEET.to_wkt(), pyproj.CRS("EPSG:32629+5703"), "NAVD88 height (ftUS)"),
        ('PROJCS["?",UNIT["US survey foot",0.304800609601]', UTM, "the US survey foot as unit"),
    ],
)
def test_a_contradiction_is_an_error(make_las, text, given, words):
    source = with_record(make_las(), wkt(text))
    with pytest.raises(InputError) as caught:
        survey_info(source, given)
    assert words in str(caught.value)
    assert str(source) in str(caught.value)
    assert "Give none for this file" in str(caught.value)
    with pytest.raises(InputError, match="the system given for it"):
        check_survey(source, crs=given)


def test_the_unit_in_a_geotiff_key_is_not_overridden(make_las):
    keys = struct.pack("<8H", 1, 1, 0, 1, 3076, 0, 1, 9002)
    source = with_record(make_las(), laspy.VLR("LASF_Projection", 34735, "", keys))
    with pytest.raises(InputError, match=r"the foot as unit \(GeoTIFF key 3076\)"):
        survey_info(source, UTM)
    assert survey_info(source, FEET).crs == FEET


def test_the_heights_of_a_compound_system_complete_one_without_heights(make_las):
    source = with_record(make_las(), wkt(UTM.to_wkt()))
    assert survey_info(source).unit_sizes == (1, 1, 1)
    info = survey_info(source, HEIGHTS_IN_FEET)
    assert info.unit_sizes == pytest.approx((1, 1, 1200 / 3937))
    assert info.unit_names == ("metre", "metre", "US survey foot")
    stated = with_record(make_las("b.las"), wkt(HEIGHTS_IN_FEET.to_wkt()))
    assert survey_info(stated, UTM).crs == HEIGHTS_IN_FEET


def test_degrees_do_not_become_metres(tmp_path):
    xyz = np.column_stack([-8.6 + np.arange(50) * 1e-5, 41.1 + np.arange(50) * 1e-5, np.arange(50)])
    write_las(tmp_path / "degrees.las", PointCloud(xyz, np.full(50, 2, np.uint8)), scale=1e-7)
    for given, words in ((UTM, "look like degrees"), (pyproj.CRS(4326), "are in degrees")):
        with pytest.raises(InputError, match=words):
            survey_of_lengths(tmp_path / "degrees.las", given)
    assert check_survey(tmp_path / "degrees.las", crs=pyproj.CRS(4326)).facts.unit == "degree"


@pytest.mark.parametrize(
    ("version", "point_format", "number"), [("1.4", 6, 2112), ("1.2", 1, 34735), ("1.4", 3, 34735)]
)
@pytest.mark.parametrize("given", [UTM, HEIGHTS_IN_FEET])
def test_a_copy_of_a_file_without_a_system_has_the_given_one(
    make_las, tmp_path, version, point_format, number, given
):
    source = make_las(version=version, point_format=point_format)
    target = copy(source, tmp_path / "out.laz", given)
    written = read_header(target)
    assert [r.record_id for r in written.vlrs if r.user_id == "LASF_Projection"] == [number]
    assert written.las.global_encoding.wkt == (number == 2112)
    assert laspy.read(target).header.parse_crs().to_2d() == given.to_2d()
    info = survey_info(target)
    assert info.unit_sizes == survey_of_lengths(source, given).unit_sizes
    assert same_system(info.crs.to_2d(), given.to_2d())
    np.testing.assert_array_equal(laspy.read(target).xyz, laspy.read(source).xyz)


def test_a_system_without_a_code_is_written_as_wkt(make_las, tmp_path):
    own = pyproj.CRS("+proj=tmerc +lat_0=40 +lon_0=-8.1 +ellps=GRS80 +units=m")
    target = copy(make_las(version="1.2", point_format=1), tmp_path / "out.laz", own)
    assert survey_info(target).crs.equals(own, ignore_axis_order=True)
    assert not read_header(target).las.global_encoding.wkt


def test_a_copy_keeps_the_record_of_its_file(make_las, tmp_path):
    broken = wkt("no system")
    source = with_record(make_las(), broken)
    target = copy(source, tmp_path / "out.laz", UTM)
    [record] = [r for r in read_header(target).vlrs if r.user_id == "LASF_Projection"]
    assert record.data == b"no system\0"
    assert survey_info(source, UTM).crs == UTM


def test_a_sample_is_written_with_the_given_system(tmp_path):
    np.save(tmp_path / "sample.npy", np.full((5, 4), 2.0))
    assert survey_info(copy(tmp_path / "sample.npy", tmp_path / "out.laz", UTM)).crs == UTM
