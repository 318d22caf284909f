"""What looks wrong is said, and a survey with nothing wrong gives no warning."""

from __future__ import annotations

import numpy as np
import pyproj
import pytest

from scenenet.pointcloud import PointCloud, write_las
from scenenet.pointcloud.class_schemes import SCHEMES, class_scheme, misfit
from scenenet.pointcloud.quality.check import check_survey
from scenenet.pointcloud.quality.screening import survey_warnings

UTM = pyproj.CRS.from_epsg(32629)
GAPS = "the bodies and conductors of towers have gaps"
N = 4000
PLACE = np.array([545_000.0, 4_633_800.0, 250.0])


def corridor(seed: int = 0) -> np.ndarray:
    """Ground on 100 x 100 m, and a tower of 20 m every 20 m."""
    rng = np.random.default_rng(seed)
    ground = rng.uniform([0, 0, 0], [100, 100, 0.3], (N - 1000, 3))
    tower = rng.uniform(0, [0.5, 0.5, 20], (1000, 3))
    tower[:, :2] += rng.integers(0, 5, (1000, 2)) * 20 + 10
    return np.round(np.concatenate([ground, tower]) + PLACE, 3)


EDP_CODES = np.repeat([2, 4, 15, 16], [N // 2, N // 4, N // 8, N // 8]).astype(np.uint8)


@pytest.fixture
def survey(tmp_path):
    def write(xyz: np.ndarray, codes=EDP_CODES, crs=UTM, name="survey.laz", scale=0.001):
        path = tmp_path / name
        if path.suffix == ".npy":
            np.save(path, np.column_stack([xyz, codes]).astype(xyz.dtype))
        else:
            write_las(path, PointCloud(xyz, codes, None, crs), scale=scale)
        return path

    return write


def warnings_of(path, codes=None) -> list[str]:
    """The warnings, which ``check`` must have as well.

    The surveys here are small and thin; that this is said is tested in test_density.py.
    """
    found = [text for text in survey_warnings(path, codes) if GAPS not in text]
    checked = check_survey(path, codes).warnings
    assert {text for text in found if "stray" not in text} <= set(checked)
    return list(found)


def test_a_survey_with_nothing_wrong_gives_no_warning(survey):
    assert warnings_of(survey(corridor()), "edp") == []
    assert warnings_of(survey(corridor())) == []


def test_heights_in_centimetres_are_reported(survey):
    (text,) = warnings_of(survey(corridor() * [1, 1, 100]))
    assert "z does not look like metres" in text
    assert "in 25 of 26 places" in text


def test_a_steep_forest_is_not_taken_for_centimetres(survey):
    xyz = corridor()
    xyz[:, 2] += 2 * (xyz[:, 0] - 545_000) + np.random.default_rng(0).uniform(0, 45, len(xyz))
    assert warnings_of(survey(xyz)) == []


def test_a_survey_in_centimetres_on_all_axes_is_reported(survey):
    xyz = (corridor() - PLACE) * 100
    assert any("points per m2, too few" in text for text in warnings_of(survey(xyz, crs=None)))


@pytest.mark.parametrize("name", ["survey.npy", "survey.laz"])
def test_coordinates_that_went_through_float32_are_reported(survey, name):
    xyz = corridor().astype(np.float32)
    xyz = xyz if name.endswith("npy") else xyz.astype(np.float64)
    (text,) = [text for text in warnings_of(survey(xyz, name=name)) if "float32" in text]
    assert "y in steps of 0.5 at 4633850" in text
    assert "x in steps of 0.0625 at 545050" in text


@pytest.mark.parametrize("step", [1.0, 0.25])
def test_a_regular_raster_is_not_taken_for_float32(survey, step):
    x, y = np.meshgrid(np.arange(0, 50, step), np.arange(0, 50, step))
    xyz = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]) + PLACE + 0.5
    assert warnings_of(survey(xyz, np.full(len(xyz), 2, np.uint8))) == []


def test_float32_close_to_zero_is_fine(survey):
    xyz = (corridor() - [545_000, 4_633_800, 0]).astype(np.float32)
    assert not any("float32" in text for text in warnings_of(survey(xyz, name="survey.npy")))


def test_coarse_steps_are_reported(survey):
    assert any("steps of 0.5 x 0.5 x 0.5" in t for t in warnings_of(survey(corridor(), scale=0.5)))


def moved_to(epsg: int) -> np.ndarray:
    xyz = corridor()
    x, y = pyproj.Transformer.from_crs(UTM, epsg, always_xy=True).transform(*xyz[:, :2].T)
    return np.round(np.column_stack([x, y, xyz[:, 2]]), 3)


@pytest.mark.parametrize(
    ("epsg", "factor"), [(3857, "1.34"), (3395, "1.34"), (32629, None), (3763, None), (25829, None)]
)
def test_maps_that_stretch_lengths_are_reported(survey, epsg, factor):
    texts = warnings_of(survey(moved_to(epsg), crs=pyproj.CRS(epsg)))
    if factor is None:
        assert texts == []
    else:
        assert f"a metre on the ground is {factor} m on the map" in texts[0]


def test_the_scale_of_a_compound_system_is_looked_at_as_well(survey):
    crs = pyproj.CRS("EPSG:3857+5773")
    assert "1.34 m on the map" in warnings_of(survey(moved_to(3857), crs=crs))[0]


@pytest.mark.parametrize("wrong", [pyproj.CRS(2056), pyproj.CRS(32629)])
def test_coordinates_outside_the_area_of_their_system_are_reported(survey, wrong):
    xyz = corridor()[:, [1, 0, 2]] if wrong == UTM else corridor()
    (text,) = warnings_of(survey(np.ascontiguousarray(xyz), crs=wrong))
    assert "outside the area of the coordinate system" in text


def test_stray_points_are_said_with_their_range(survey):
    xyz = corridor()
    xyz[7] = [945_000, 4_633_800, 250]
    (text,) = [text for text in survey_warnings(survey(xyz)) if GAPS not in text]
    assert text.startswith("stray coordinates") and "x 545000 to 945000" in text
    assert "y 4" not in text


def test_nothing_is_said_of_a_handful_of_points_but_what_is_sure(survey):
    xyz = corridor()[:5]
    assert warnings_of(survey(xyz, EDP_CODES[:5])) == []
    assert warnings_of(survey(np.empty((0, 3)), EDP_CODES[:0])) == ["the survey has no points"]


# --- class codes ------------------------------------------------------------------------------


def coded(**points: int) -> np.ndarray:
    counts = np.zeros(256, np.int64)
    for code, number in points.items():
        counts[int(code[1:])] = number
    return counts


@pytest.mark.parametrize(
    ("scheme", "counts", "other"),
    [
        ("asprs", coded(c2=9000, c15=400, c16=800), "edp"),
        ("asprs", coded(c2=9000, c17=800), "edp"),  # the other power line
        ("edp", coded(c2=9000, c15=400, c14=800), "asprs"),
        ("edp", coded(c2=9000, c13=90, c14=4800, c16=200), "asprs"),  # with insulators
        ("edp", coded(c2=9000, c15=400, c16=800), None),
        ("asprs", coded(c2=9000, c15=400, c14=800, c16=100), None),
        ("edp", coded(c2=9000, c14=2000, c16=800), None),  # low reliability
        ("asprs", coded(c2=9000, c4=5000, c5=7000), None),  # no line at all
        ("ts40k", coded(c0=5, c1=9000, c4=40, c5=70), None),
        ("asprs", coded(), None),
    ],
)
def test_codes_of_another_scheme_are_recognised(scheme, counts, other):
    text = misfit(class_scheme(scheme), counts)
    assert (text is None) == (other is None), text
    if other:
        assert f"look like those of scheme {other}, not {scheme}" in text


def test_every_scheme_fits_itself():
    for scheme in SCHEMES.values():
        counts = np.zeros(256, np.int64)
        counts[list(scheme.classes)] = 1000
        assert misfit(scheme, counts) is None


def test_codes_that_do_not_fit_the_scheme_are_reported(survey):
    (text,) = warnings_of(survey(corridor()), "asprs")
    assert "code 16 (500 points) is 'Main power line' in edp" in text


def test_towers_without_conductors_are_said_with_the_codes_of_the_file(survey):
    codes = np.where(EDP_CODES == 16, 77, EDP_CODES).astype(np.uint8)
    undefined, text = warnings_of(survey(corridor(), codes), "edp")
    assert "does not define these codes: 77" in undefined
    assert "500 points are labelled tower, and 0 conductor (code 16 or 17 in edp)" in text
    assert "name it with --codes" in text
    assert "the codes 2 (2000 points), 4 (1000 points), 15 (500 points), 77 (500 points)" in text


def test_without_towers_the_codes_of_the_file_are_said(survey):
    codes = np.where(EDP_CODES == 15, 1, EDP_CODES).astype(np.uint8)
    (text,) = warnings_of(survey(corridor(), codes), "edp")
    assert "no point is labelled tower (code 15 in edp)" in text
    assert text.endswith("2 (2000 points), 4 (1000 points), 1 (500 points), 16 (500 points)")


def test_the_samples_of_a_folder_are_judged_together(survey, tmp_path):
    xyz = corridor()
    single = xyz.astype(np.float32)
    for name, points in (("a.npy", xyz), ("b.npy", single), ("c.npy", single)):
        survey(points, name=name)
    texts = warnings_of(tmp_path, "asprs")
    assert next(text for text in texts if "float32" in text).endswith(
        "(b.npy and 1 more of 3 samples)"
    )
    assert len([text for text in texts if "no coordinate system" in text]) == 1
    assert any(f"code 16 ({3 * 500} points)" in text for text in texts)
