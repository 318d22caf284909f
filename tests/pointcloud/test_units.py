"""Coordinates that are not metres are refused on every axis, and nothing else is."""

from __future__ import annotations

import struct

import laspy
import numpy as np
import pyproj
import pytest

from scenenet.core.errors import InputError
from scenenet.pointcloud import PointCloud, survey_in_metres, write_las
from scenenet.pointcloud.quality.check import check_survey
from scenenet.pointcloud.units import look_like_degrees

MODEL, GEOGRAPHIC, PROJECTED, LINEAR, SIZE = 1024, 2048, 3072, 3076, 3077
VERTICAL, VERTICAL_UNIT = 4096, 4099
UTM = 32629


def keys(*entries: tuple[int, int]) -> laspy.VLR:
    """GeoTIFF keys with numbers as values."""
    data = struct.pack("<4H", 1, 1, 0, len(entries))
    data += b"".join(struct.pack("<4H", key, 0, 1, value) for key, value in entries)
    return laspy.VLR("LASF_Projection", 34735, "keys", data)


def wkt(text: str, user: str = "LASF_Projection") -> laspy.VLR:
    return laspy.VLR(user, 2112, "WKT", text.encode() + b"\0")


@pytest.fixture
def with_records(make_las):
    def make(*records: laspy.VLR):
        path = make_las("in.las", version="1.4", point_format=6)
        las = laspy.read(path)
        las.header.vlrs.extend(records)
        las.write(path)
        return path

    return make


COMPOUND_FEET = pyproj.CRS("EPSG:32629+6360")
"""Metres in plan, heights in US survey feet."""


@pytest.mark.parametrize(
    ("records", "words"),
    [
        ([wkt(COMPOUND_FEET.to_wkt("WKT2_2019"))], "heights is the US survey foot (0.304801 m)"),
        ([wkt(COMPOUND_FEET.to_wkt("WKT1_GDAL"))], "heights is the US survey foot"),
        ([keys((MODEL, 1), (PROJECTED, UTM), (VERTICAL, 6360))], "heights is the US survey foot"),
        ([keys((PROJECTED, UTM), (VERTICAL, 5703), (VERTICAL_UNIT, 9003))], "GeoTIFF key 4099"),
        ([keys((PROJECTED, UTM), (VERTICAL, 5103), (VERTICAL_UNIT, 9002))], "heights is the foot"),
        ([keys((PROJECTED, UTM), (VERTICAL, 6360), (VERTICAL_UNIT, 9001))], "NAVD88 height (ftUS)"),
        (
            [
                wkt(pyproj.CRS(UTM).to_wkt("WKT1_GDAL")),
                keys((PROJECTED, UTM), (VERTICAL_UNIT, 9003)),
            ],
            "heights is the US survey foot",
        ),
        ([keys((PROJECTED, 32767), (LINEAR, 9003))], "coordinates is the US survey foot"),
        ([keys((PROJECTED, UTM), (LINEAR, 9002))], "coordinates is the foot (0.3048 m)"),
        ([keys((PROJECTED, 2994))], "coordinates is the foot"),
        ([wkt(pyproj.CRS(2994).to_wkt("WKT1_GDAL"), "liblas")], "coordinates is the foot"),
        ([wkt('PROJCS["broken",UNIT["US survey foot",0.3048006]')], "cannot be parsed otherwise"),
        (
            [wkt('COMPD_CS["b",PROJCS["c",UNIT["metre",1]],VERT_CS["d",UNIT["ft",0.3048]]')],
            "heights is the ft",
        ),
        ([wkt(pyproj.CRS(4979).to_wkt())], "degrees"),
        ([keys((MODEL, 2), (GEOGRAPHIC, 4326))], "degrees"),
        ([wkt(pyproj.CRS(4978).to_wkt())], "geocentric"),
        ([wkt(pyproj.CRS("EPSG:32629+5706").to_wkt())], "depth"),
    ],
)
def test_a_unit_that_is_not_the_metre_is_refused_on_every_axis(with_records, records, words):
    path = with_records(*records)
    with pytest.raises(InputError, match="Reproject") as caught:
        survey_in_metres(path)
    assert words in str(caught.value)
    assert str(path) in str(caught.value)
    warned = [text for text in check_survey(path).warnings if words in text]
    assert len(warned) == 1, "check says it too, and once"


def test_the_size_of_a_unit_of_the_users_own_is_read(with_records):
    doubles = laspy.VLR("LASF_Projection", 34736, "doubles", struct.pack("<2d", 1.0, 0.9144))
    data = struct.pack("<4H", 1, 1, 0, 3) + struct.pack("<4H", PROJECTED, 0, 1, 32767)
    data += struct.pack("<8H", LINEAR, 0, 1, 32767, SIZE, 34736, 1, 1)
    path = with_records(laspy.VLR("LASF_Projection", 34735, "keys", data), doubles)
    with pytest.raises(InputError, match=r"unit of 0\.9144 m"):
        survey_in_metres(path)


@pytest.mark.parametrize(
    ("records", "epsg"),
    [
        ([], None),
        ([wkt(pyproj.CRS("EPSG:32629+5703").to_wkt())], None),
        ([wkt(pyproj.CRS(7415).to_wkt())], 7415),
        ([wkt(pyproj.CRS(UTM).to_wkt("WKT1_GDAL"), "liblas")], UTM),
        ([keys((PROJECTED, UTM), (LINEAR, 9001), (VERTICAL, 5703), (VERTICAL_UNIT, 9001))], UTM),
        ([keys((PROJECTED, UTM), (VERTICAL, 5103))], UTM),
        ([keys((PROJECTED, UTM), (GEOGRAPHIC, 4326))], UTM),
        ([wkt("nonsense")], None),
        ([laspy.VLR("LASF_Projection", 34735, "keys", b"\1\0")], None),
    ],
)
def test_metres_and_unknown_units_are_not_refused(with_records, records, epsg):
    info = survey_in_metres(with_records(*records))
    assert (info.crs.to_epsg() if info.crs and epsg else None) == epsg


def test_a_record_that_cannot_be_parsed_does_not_hide_a_better_one(with_records):
    info = survey_in_metres(with_records(wkt("nonsense"), keys((PROJECTED, UTM))))
    assert info.crs.to_epsg() == UTM
    assert info.warnings == ()


def test_an_unknown_unit_is_said(with_records):
    path = with_records(keys((PROJECTED, 32767), (VERTICAL_UNIT, 1234)))
    assert any("key 4099 has the unknown code 1234" in text for text in check_survey(path).warnings)


# --- degrees without a coordinate system ------------------------------------------------------


def degrees(n: int = 2000, width: float = 0.02) -> np.ndarray:
    rng = np.random.default_rng(0)
    return rng.uniform([-8.1, 41.2, 80], [-8.1 + width, 41.2 + width, 130], (n, 3))


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("scale", [1e-7, 1e-6, 1e-5, None])
def test_degrees_without_a_coordinate_system_are_refused_with_one_message(tmp_path, scale, swapped):
    xyz = degrees()[:, [1, 0, 2] if swapped else [0, 1, 2]]
    codes = np.full(len(xyz), 2, np.uint8)
    if scale is None:
        path = tmp_path / "degrees.npy"
        np.save(path, np.column_stack([xyz, codes]))
    else:
        path = tmp_path / "degrees.las"
        write_las(path, PointCloud(np.ascontiguousarray(xyz), codes), scale=scale)
    with pytest.raises(InputError, match="look like degrees"):
        survey_in_metres(path)
    about = [t for t in check_survey(path).warnings if "degree" in t or "metres" in t]
    assert len(about) == 1, about


@pytest.mark.parametrize(
    ("low", "high", "step"),
    [
        ([0, 0, 0], [80, 60, 20], 0.001),  # a local system
        ([-30, -30, -2], [30, 30, 25], 1e-5),  # a terrestrial scan in fine steps
        ([0, 0, 0], [0.8, 0.8, 30], 1e-4),  # the points of one pole
        ([0, 0, 0], [1, 1, 1], None),  # a normalised sample
        ([500_000, 4_630_000, 100], [500_100, 4_630_100, 150], 1e-6),
        ([np.nan] * 3, [np.nan] * 3, 1e-7),  # no points
    ],
)
def test_local_coordinates_in_metres_are_not_taken_for_degrees(low, high, step):
    assert not look_like_degrees(low, high, None if step is None else (step,) * 3)


def test_degrees_behind_a_wrong_bounding_box_are_found_in_the_points(tmp_path, patched):
    from scenenet.pointcloud import iter_chunks, survey_info
    from scenenet.pointcloud.quality.screening import Screening

    path = tmp_path / "degrees.las"
    write_las(path, PointCloud(degrees(), np.full(2000, 2, np.uint8)), scale=1e-7)
    path = patched(path, {179: struct.pack("<6d", 1e6, 0, 1e6, 0, 1e3, 0)})
    assert survey_info(path).not_metres is None
    screening = Screening(survey_info(path))
    for chunk in iter_chunks(path):
        screening.add(chunk.xyz, chunk.classification)
    with pytest.raises(InputError, match="look like degrees"):
        screening.raise_if_not_metres()
