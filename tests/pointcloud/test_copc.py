"""LAZ files as COPC, where PDAL is installed."""

from __future__ import annotations

import shutil

import laspy
import numpy as np
import pyproj
import pytest

from scenenet.core.errors import InputError
from scenenet.pointcloud import survey_info
from scenenet.pointcloud.copc import check_copc, pipeline, require_pdal, write_copc

EXTRA = {"tower_probability": "f4", "tower_id": "u4", "height above ground": "f4"}


@pytest.fixture
def survey(make_las):
    return make_las("in.laz", n=5000, crs=pyproj.CRS(32629), extra=EXTRA, scale=0.001)


@pytest.fixture
def without_pdal(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))


def test_without_pdal_nothing_is_written(survey, without_pdal, tmp_path):
    with pytest.raises(InputError, match=r"pdal, which is not on PATH.*leave --copc out"):
        write_copc(survey, tmp_path / "out.copc.laz")
    assert not (tmp_path / "out.copc.laz").exists()


def test_another_program_of_this_name_is_refused(without_pdal, tmp_path):
    (tmp_path / "pdal").symlink_to(shutil.which("echo", path="/bin:/usr/bin"))
    with pytest.raises(InputError, match=r"this pdal has no writers\.copc"):
        require_pdal()
    (tmp_path / "pdal").unlink()
    (tmp_path / "pdal").write_text("no program")
    (tmp_path / "pdal").chmod(0o755)
    with pytest.raises(InputError, match="cannot be started"):
        require_pdal()


def test_the_pipeline_asks_for_everything_that_pdal_would_drop(tmp_path):
    reader, writer = pipeline(tmp_path / "a.laz", tmp_path / "a.copc.laz")
    assert reader == {
        "type": "readers.las", "filename": str(tmp_path / "a.laz"), "use_eb_vlr": True
    }  # fmt: skip
    assert writer == {
        "type": "writers.copc", "filename": str(tmp_path / "a.copc.laz"), "forward": "all",
        "extra_dims": "all",
    }  # fmt: skip


def test_a_file_that_lacks_something_is_refused(survey, make_las):
    other = make_las("out.laz", n=4999, extra={"tower_id": "u4"}, scale=0.01)
    with pytest.raises(InputError) as caught:
        check_copc(survey, other)
    for words in (
        "LAZ and not COPC", "4999 points in place of 5000", "its steps are",
        "lacks the dimensions tower_probability, height above ground", "the coordinate system",
    ):  # fmt: skip
        assert words in str(caught.value)


def test_a_real_copc_file_passes_the_check(real_data):
    path = real_data / "zoo" / "PDAL__1.2-with-color.copc.laz"
    check_copc(path, path)


def test_pdal_writes_every_point_and_dimension(survey, tmp_path):
    if shutil.which("pdal") is None:
        pytest.skip("no pdal here: install PDAL to test the conversion itself")
    write_copc(survey, tmp_path / "out.copc.laz")
    assert survey_info(tmp_path / "out.copc.laz").format == "copc"
    before, after = laspy.read(survey), laspy.read(tmp_path / "out.copc.laz")
    order, other = (np.lexsort([c.Z, c.Y, c.X, c.gps_time]) for c in (before, after))
    for name in ("X", "Y", "Z", "classification", "tower_probability", "tower_id"):
        np.testing.assert_array_equal(
            np.asarray(after[name])[other], np.asarray(before[name])[order], err_msg=name
        )
