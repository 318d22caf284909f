"""Forty-two defective files: each quickly gives its points or an error that names it."""

from __future__ import annotations

import csv
import os
import re
import time
from pathlib import Path

import laspy
import numpy as np
import pytest

from scenenet.core.errors import InputError
from scenenet.pointcloud import read, survey_info
from scenenet.pointcloud.quality.check import check_survey

TIME_LIMIT_S = 10
REFUSED = {
    "PDAL__1.2-no-points.las": "claims 1065 points, but the file has room for only 0",
    "PDAL__garbage_nVariableLength.las": "claims 1069128089 variable length records",
    "PDAL__simple-laszip-compressor-version-1.2r0.laz": "no chunk table",
    "git_lfs_pointer.copc.laz": "git lfs pull",
    "ign-pdal-tools__Semis_2022_0906_6665_LA93_IGN69_nok.laz": "did not finish",
    "laspy_truncated.laz": "chunks",
    "lidar-prod__dummy_file1.las": "empty",
    "loaders.gl__pdrf7-v4-1.4.laz": "version: 4 is not supported",
}


def zoo() -> list[str]:
    root = Path(__file__).resolve().parents[3] / "shared" / "data"
    manifest = Path(os.environ.get("SCENENET_REAL_DATA", root)) / "zoo" / "MANIFEST.tsv"
    if not manifest.exists():
        return []
    with manifest.open(newline="", encoding="utf-8") as stream:
        return [row["file"] for row in csv.DictReader(stream, delimiter="\t")]


@pytest.fixture
def manifest(real_data) -> dict[str, dict[str, str]]:
    path = real_data / "zoo" / "MANIFEST.tsv"
    with path.open(newline="", encoding="utf-8") as stream:
        return {row["file"]: row for row in csv.DictReader(stream, delimiter="\t")}


def test_the_zoo_is_complete(manifest):
    assert len(manifest) == 42
    assert set(manifest) >= REFUSED.keys()


@pytest.mark.parametrize("name", zoo() or ["MANIFEST.tsv"])
def test_every_file_ends_in_its_points_or_an_error_that_names_it(name, real_data, manifest):
    path = real_data / "zoo" / name
    start = time.perf_counter()
    if name in REFUSED:
        for reader in (read, check_survey):
            with pytest.raises(InputError) as caught:
                reader(path)
            assert name in str(caught.value)
            assert REFUSED[name] in str(caught.value)
            assert caught.value.remedy
    else:
        cloud, info, report = read(path, "asprs"), survey_info(path), check_survey(path, "asprs")
        listed = re.search(r"n=(\d+)", manifest[name]["laspy_2.7.0_lazrs"])
        assert listed is not None
        assert len(cloud) == info.n_points == report.to_json()["n_points"] == int(listed[1])
        assert np.isfinite(cloud.xyz).all()
    assert time.perf_counter() - start < TIME_LIMIT_S


@pytest.mark.parametrize("name", zoo() or ["MANIFEST.tsv"])
def test_where_laspy_reads_the_whole_file_the_points_are_the_same(name, real_data, manifest):
    if name in REFUSED:
        pytest.skip("laspy does not read this file, or not all of it")
    path = real_data / "zoo" / name
    cloud, peer = read(path), laspy.read(path)
    np.testing.assert_array_equal(cloud.xyz, np.column_stack([peer.x, peer.y, peer.z]))
    np.testing.assert_array_equal(cloud.classification, np.asarray(peer.classification))


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("PDAL__bad_vlr_count.las", "3 variable length records"),
        ("PDAL__gps-time-nan.las", "GPS time"),
        ("PDAL__spurious.las", "stray"),
        ("PDAL__spurious.las", "degrees"),
        ("PDAL__wontcompress3.las", "895 points marked as withheld"),
        ("PDAL__no-points.las", "no points"),
        ("lasR__las14_pdrf6.laz", "look like 1, 15 with flags"),
        ("lasR__las14_pdrf6.laz", "coordinate system (WKT record)"),
        ("lasR__nocrs.las", "no coordinate system"),
        ("laszip4j__500m_5460_59370_IM2023_subset.laz", "stray coordinates: 3 points"),
        ("libLAS__certainty3d-color-utm-feet-navd88.las", "US survey foot"),
        ("libLAS__bad_points_1.1.las", "impossible return number"),
    ],
)
def test_defects_of_a_readable_file_are_reported(name, words, real_data):
    warnings = check_survey(real_data / "zoo" / name, "asprs").warnings
    assert any(words in warning for warning in warnings), warnings
