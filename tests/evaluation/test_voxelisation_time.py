"""Every crop is voxelised on every grid of the thesis, and timed."""

from __future__ import annotations

import pandas as pd
import pytest

from scenenet.dataset.crops import CropSettings, cut_crops, read_crops
from scenenet.dataset.labelled_towers import TowerSettings, survey_towers
from scenenet.dataset.voxels import VoxelGrid, voxelise
from scenenet.evaluation import voxelisation_time
from scenenet.evaluation.voxelisation_time import COLUMNS, RESOLUTIONS, time_grids
from scenenet.synthetic import SyntheticSettings, make_survey


@pytest.mark.parametrize("most", [400, 1])
def test_a_row_for_every_timed_crop_and_grid(tmp_path, monkeypatch, most):
    monkeypatch.setattr(voxelisation_time, "MOST_CROPS", most)
    line = tmp_path / "line.laz"
    make_survey(SyntheticSettings(towers=2, seed=5, density=8, tower_density=16), line)
    manifest = tmp_path / "crops.json"
    towers = survey_towers(line, "edp", TowerSettings()).towers
    cut_crops("line", line, "edp", towers, CropSettings(), tmp_path / "crops.zarr.zip", manifest)
    table = time_grids([manifest], tmp_path / "grids.csv")
    assert tuple(pd.read_csv(tmp_path / "grids.csv").columns) == COLUMNS
    clouds = {crop.id: cloud for crop, cloud in read_crops(manifest)}
    assert len(clouds) == 2
    assert len(table) == min(most, len(clouds)) * len(RESOLUTIONS)
    assert (table["seconds"] > 0).all()
    for found in table.itertuples():
        cloud = clouds[found.crop]
        grid = VoxelGrid.cube(cloud.xyz, int(found.grid.removeprefix("cube-")))
        sample = voxelise(cloud, grid, found.crop)
        assert (found.occupied, found.tower) == (len(sample.index), sample.labelled.sum())
