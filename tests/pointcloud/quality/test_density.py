"""A survey that is too thin to show towers is said to be."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.pointcloud import PointCloud, write_las
from scenenet.pointcloud.quality.check import check_survey
from scenenet.pointcloud.quality.screening import survey_warnings
from scenenet.pointcloud.targets import Target


def gap_warnings(tmp_path, density: float, side: float = 60.0) -> list[str]:
    rng = np.random.default_rng(0)
    xyz = rng.uniform(0, [side, side, 1], (round(density * side**2), 3)) + np.array(
        [545_000, 4_633_800, 200]
    )
    path = tmp_path / "survey.laz"
    write_las(path, PointCloud(xyz, np.full(len(xyz), 2, np.uint8), None, None))
    found = [text for text in survey_warnings(path) if "have gaps" in text]
    assert found == [text for text in check_survey(path).warnings if "have gaps" in text]
    return found


@pytest.mark.parametrize("density", [2.0, 5.0, 9.0])
def test_a_thin_survey_is_said_with_its_density(tmp_path, density):
    (text,) = gap_warnings(tmp_path, density)
    figure = float(text.split("about ")[1].split(" points")[0])
    assert figure == pytest.approx(density, rel=0.2)


@pytest.mark.parametrize("density", [20.0, 80.0])
def test_a_dense_survey_is_not(tmp_path, density):
    assert gap_warnings(tmp_path, density) == []


def test_a_thin_survey_is_no_fault_where_no_towers_are_looked_for(tmp_path):
    assert gap_warnings(tmp_path, 5.0)
    lamps = survey_warnings(tmp_path / "survey.laz", target=Target.parse("lamp=19"))
    assert not [text for text in lamps if "have gaps" in text]


def test_a_survey_so_thin_that_the_unit_is_in_doubt_has_one_warning(tmp_path):
    assert gap_warnings(tmp_path, 0.05, side=400.0) == []
