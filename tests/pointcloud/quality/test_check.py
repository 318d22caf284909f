"""The results of a check agree with counts by hand."""

from __future__ import annotations

import json
import struct

import numpy as np
import pandas as pd
import pyproj
import pytest
import torch

from scenenet.core.errors import InputError
from scenenet.pointcloud import PointCloud, write_las
from scenenet.pointcloud.quality.cell_counts import CellCounts, DuplicateCount
from scenenet.pointcloud.quality.check import CheckSettings, check_survey
from scenenet.pointcloud.quality.report import SurveyReport

UTM = pyproj.CRS.from_epsg(32629)


@pytest.fixture
def grid_survey(tmp_path):
    """A survey of one point per square metre on 40 x 20 m, ten of them tower."""
    x, y = np.meshgrid(np.arange(40) + 0.5, np.arange(20) + 0.5)
    xyz = np.column_stack([x.ravel() + 544e3, y.ravel() + 4634e3, np.full(800, 100.0)])
    codes = np.full(800, 2, np.uint8)
    codes[:10] = 15

    def write(name="grid.laz", crs=UTM, add=(), add_codes=()):
        points = np.concatenate([xyz, np.array(add).reshape(-1, 3)])
        classes = np.concatenate([codes, np.array(add_codes, np.uint8)])
        path = tmp_path / name
        write_las(path, PointCloud(points, classes, None, crs))
        return path

    return write


def test_counts_density_and_extent(grid_survey):
    report = check_survey(grid_survey(), "edp")
    facts = report.to_json()
    assert facts["n_points"] == 800
    assert facts["area_m2"] == 800
    assert facts["density_per_m2"] == 1
    assert facts["epsg"] == 32629
    assert facts["unit"] == "metre"
    np.testing.assert_allclose(np.subtract(facts["maxs"], facts["mins"]), [39, 19, 0])
    (text,) = report.warnings
    assert "10 points are labelled tower, and 0 conductor" in text


def test_class_densities_are_percent_of_all_points_as_in_table_5_1(grid_survey):
    classes = check_survey(grid_survey(), "edp").classes
    assert list(classes.columns) == ["code", "class", "points", "share_percent"]
    assert len(classes) == 22, "every class of the scheme has its row"
    by_code = classes.set_index("code")
    assert by_code.loc[15, "points"] == 10
    assert by_code.loc[15, "share_percent"] == pytest.approx(1.25)
    assert by_code.loc[16, "points"] == 0
    assert classes["share_percent"].sum() == pytest.approx(100)


def test_the_report_is_json_and_a_table(grid_survey):
    report = check_survey(grid_survey(), "edp")
    data = json.loads(json.dumps(report.to_json(), allow_nan=False))
    assert {
        "code": 15,
        "class": "Power line support tower",
        "points": 10,
        "share_percent": 1.25,
    } in (data["classes"])
    read = SurveyReport.from_json(data)
    assert (read.facts, read.warnings) == (report.facts, report.warnings)
    pd.testing.assert_frame_equal(read.classes, report.classes)
    for word in ("800", "Power line support tower", "EPSG:32629", "1.250"):
        assert word in report.text()


def warned(path, codes, word) -> bool:
    return any(word in warning for warning in check_survey(path, codes).warnings)


def test_each_oddity_has_its_warning(grid_survey, patched):
    assert warned(grid_survey(crs=None), "edp", "no coordinate system")
    assert warned(grid_survey(), "ts40k", "labelled tower")
    assert warned(grid_survey(crs=pyproj.CRS.from_epsg(2229)), "edp", "US survey foot")
    assert warned(grid_survey(add=[[544e3, 4634e3 + 9e4, 100]], add_codes=[1]), "edp", "stray")
    twin = [[544_000.5, 4_634_000.5, 100.0]]
    assert warned(grid_survey(add=twin, add_codes=[2]), "edp", "duplicates: 1 point")
    assert warned(grid_survey(add=[[544e3, 4634e3, 101]], add_codes=[77]), "edp", "77 (1 point)")
    flagged = grid_survey(add=[[544e3, 4634e3, 101]], add_codes=[143])
    assert warned(flagged, "edp", "look like 15 with flags")
    box = patched(grid_survey("a.las"), {179: struct.pack("<d", 544_010.0)})
    assert warned(box, "edp", "600 points outside the bounding box")


def test_degrees_are_reported_and_give_no_density(tmp_path):
    path = tmp_path / "degrees.las"
    xyz = np.column_stack([np.linspace(-8.1, -8.0, 200), np.linspace(41, 41.1, 200), np.ones(200)])
    write_las(path, PointCloud(xyz, np.full(200, 2, np.uint8)), scale=1e-7)
    report = check_survey(path, "edp")
    assert any("degrees" in warning for warning in report.warnings)
    assert report.to_json()["density_per_m2"] is None


def test_without_a_scheme_codes_stay_numbers_and_mean_nothing(grid_survey):
    report = check_survey(grid_survey(), None)
    assert report.classes["class"].tolist() == ["code 2", "code 15"]
    assert report.warnings == ()


def test_the_samples_of_a_folder_are_checked_together(tmp_path):
    rng = np.random.default_rng(0)
    folder = tmp_path / "samples"
    folder.mkdir()
    shares = {"a.npy": (300, 100), "b.npy": (200, 0)}
    for number, (name, (ground, tower)) in enumerate(shares.items()):
        xyz = rng.uniform(0, 10, (ground + tower, 3))
        xyz[:, 0] += 100 * number
        codes = np.repeat([2, 15], [ground, tower])
        np.save(folder / name, np.column_stack([xyz, codes]))
    (folder / "notes.txt").write_text("no sample")
    report = check_survey(folder, "edp")
    single = [check_survey(folder / name, "edp") for name in shares]
    points = report.classes.set_index("code")["points"]
    assert (points[2], points[15], points.sum()) == (500, 100, 600)
    assert report.classes.set_index("code").loc[15, "share_percent"] == pytest.approx(100 / 6)
    facts = report.to_json()
    assert (facts["survey"], facts["samples"], facts["n_points"]) == ("samples", 2, 600)
    assert facts["area_m2"] == sum(one.facts.area_m2 for one in single)
    assert facts["mins"][0] < 1 and facts["maxs"][0] > 109
    assert "no point is labelled tower in 1 of 2 samples: b.npy" in report.warnings
    assert "samples: NPY" in report.text()
    assert json.loads(json.dumps(facts)) == facts
    assert SurveyReport.from_json(facts).facts == report.facts


def test_a_folder_without_samples_is_refused(tmp_path):
    with pytest.raises(InputError, match="no TS40K sample"):
        check_survey(tmp_path, "edp")


def test_merged_classes_of_a_ts40k_sample_read_as_edp_give_a_warning(tmp_path):
    path = tmp_path / "sample.pt"
    codes = torch.tensor([1, 4, 5, 2])
    torch.save({"input_pcd": torch.rand(4, 3), "semantic_labels": codes}, path)
    assert warned(path, "edp", "use class scheme ts40k")
    assert not warned(path, "ts40k", "use class scheme ts40k")


@pytest.mark.parametrize("point_format", [1, 3, 6, 7])
def test_times_that_are_not_numbers_and_withheld_points_are_counted(
    make_las, patched, point_format
):
    path = make_las(version="1.4", point_format=point_format, n=1, crs=UTM)
    header_end = struct.unpack_from("<I", path.read_bytes(), 96)[0]
    at = header_end + (20 if point_format < 6 else 22)
    flags = {header_end + 15: bytes([0x80 | 2 if point_format < 6 else 0x04])}
    odd = patched(path, {at: struct.pack("<d", np.nan)} | flags)
    facts = check_survey(odd, "edp").to_json()
    assert facts["points_without_gps_time"] == 1
    assert facts["withheld_points"] == 1


def test_an_empty_survey_has_a_report(tmp_path):
    path = tmp_path / "empty.laz"
    write_las(path, PointCloud(np.empty((0, 3)), np.empty(0, np.uint8)))
    report = check_survey(path, "edp")
    assert report.to_json()["n_points"] == 0
    assert "no points" in report.warnings[0]
    assert report.text()


def test_chunks_do_not_change_the_report(grid_survey):
    path = grid_survey()
    whole = check_survey(path, "edp").to_json()
    assert check_survey(path, "edp", CheckSettings(chunk_points=7)).to_json() == whole


def test_a_file_that_cannot_be_read_has_no_report(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        check_survey(tmp_path / "absent.laz", "edp")


# --- counting in bounded memory ---------------------------------------------------------------


def test_cells_grow_where_they_get_too_many_and_lose_no_point():
    rng = np.random.default_rng(0)
    cells = CellCounts(1.0, max_cells=500)
    for _ in range(5):
        u, v = rng.uniform(-500, 500, (2, 1000))
        cells.add(u, v)
    assert cells.n_cells <= 500
    assert cells.cell >= 32
    assert cells._counts.sum() == 5000


def test_cells_on_both_sides_of_zero_are_different_cells():
    cells = CellCounts(1.0, max_cells=100)
    cells.add(np.array([-0.5, 0.5, 0.6, 1e300]), np.array([0.5, -0.5, -0.5, -1e300]))
    assert cells.n_cells == 3
    assert sorted(cells.axis(1).tolist()) == [-(2**30), -1, 0]


def test_duplicates_are_exact_while_they_fit_and_estimated_beyond():
    rng = np.random.default_rng(0)
    places = rng.integers(0, 2**40, (20_000, 3)).astype(np.uint64)
    points = np.concatenate([places, places[:5000]])
    exact, sampled = DuplicateCount(100_000), DuplicateCount(2000)
    for part in np.array_split(rng.permutation(points), 10):
        exact.add(part)
        sampled.add(part)
    assert exact.estimate(25_000) == 5000
    assert not exact.is_sampled
    assert sampled.is_sampled
    assert sampled.estimate(25_000) == pytest.approx(5000, rel=0.15)
