"""The data of an interactive crop agree with the evaluation of the crop."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path

import numpy as np
import pytest
import torch
from fixtures.scenes import make_scene

from scenenet.convolution.coarsening import coarsened
from scenenet.core.errors import InputError
from scenenet.dataset.batches import batch
from scenenet.dataset.voxels import VoxelGrid, VoxelSample, voxelise
from scenenet.figures.interactive_crop import CLASSES, PALETTE, _shares, write_interactive_crop
from scenenet.metrics.threshold_curve import THRESHOLDS, ThresholdCurve
from scenenet.models.metric_scenenet import MetricSceneNet
from scenenet.report import page
from scenenet.results.folder import Results


def decoded(text: str, kind: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), kind)


@pytest.fixture
def scene(results: Results, tmp_path: Path) -> dict:
    write_interactive_crop(results, "scenenet", "median", tmp_path / "median.json")
    return json.loads((tmp_path / "median.json").read_text())


def test_every_voxel_has_a_position_a_class_and_a_share_of_each_kernel(scene):
    tower = decoded(scene["tower"], "<u1")
    classes = decoded(scene["class"], "<u1")
    assert len(decoded(scene["zyx"], "<i2")) == 3 * len(tower)
    # A voxel with a tower point has the class tower, whatever else is in it.
    assert set(classes[tower > 0]) == {CLASSES.index("tower")}
    assert {CLASSES[code] for code in set(classes)} == {"ground", "conductor", "tower"}
    assert list(scene["shares"]) == ["cylinder", "arrow", "negative_sphere"]
    shares = np.array([decoded(text, "<i1") for text in scene["shares"].values()], int)
    assert np.abs(np.abs(shares).sum(axis=0) - 100).max() <= 2


def test_the_counts_are_those_of_the_whole_grid(scene):
    curve = ThresholdCurve(np.array(scene["true"]), np.array(scene["false"]))
    assert curve.true.sum() == decoded(scene["tower"], "<u1").sum()
    assert curve.true.sum() + curve.false.sum() == 32**3
    # The counts of all voxels are at least those of the occupied voxels.
    steps, tower = decoded(scene["steps"], "<u2"), decoded(scene["tower"], "<u1") > 0
    np.testing.assert_array_equal(np.bincount(steps[tower], minlength=651), curve.true)
    assert (np.bincount(steps[~tower], minlength=651)[1:] <= curve.false[1:]).all()
    assert len(scene["taus"]) == len(THRESHOLDS)


def test_scores_of_whole_towers_follow_from_their_voxels(scene):
    tower, whole = (decoded(scene[name], "<u1") > 0 for name in ("tower", "whole"))
    tp, fp = (whole & tower).sum(), (whole & ~tower).sum()
    assert whole.any()
    assert scene["whole_scores"]["precision"] == pytest.approx(tp / (tp + fp))
    assert scene["whole_scores"]["recall"] == pytest.approx(tp / tower.sum())


def test_the_shares_in_a_fine_grid_are_those_of_the_blocks_that_the_model_observes():
    model = MetricSceneNet(generator=torch.Generator().manual_seed(3))
    cloud = make_scene()
    fine = voxelise(cloud, VoxelGrid.metric(cloud.xyz, 0.5))
    blocks, row = coarsened(batch([fine], "presence")[0], 2)
    ones = np.ones(len(blocks.index), np.int32)
    grid = VoxelGrid(fine.grid.origin, 1.0, blocks.shape)
    coarse = VoxelSample("blocks", grid, blocks.index.astype(np.int32), ones, ones > 1)
    of_blocks, of_voxels = (_shares(model, sample, "presence") for sample in (coarse, fine))
    for name in ("cylinder", "arrow", "negative_sphere"):
        np.testing.assert_array_equal(of_voxels[name], of_blocks[name][row])


def test_the_file_is_read_as_what_was_written(results, tmp_path):
    file = results.folder / "interactive_crop" / "best.json"
    written = write_interactive_crop(results, "scenenet", "best", file)
    read = results.interactive_crop("best")
    assert (
        read.to_json() == json.loads(file.read_text()) == json.loads(json.dumps(written.to_json()))
    )
    for name in ("zyx", "voxel_class", "tower", "steps", "whole"):
        np.testing.assert_array_equal(getattr(read, name), getattr(written, name))
    assert read.whole_scores == written.whole_scores
    file.write_text(file.read_text().replace('"tau_step"', '"step"'))
    with pytest.raises(InputError, match="another version"):
        results.interactive_crop("best")


def test_the_view_has_no_colours_but_those_of_the_palette():
    assert set(PALETTE["class"]) == set(CLASSES)
    script = (page.ASSETS / "page.js").read_text(encoding="utf-8")
    used = set(re.findall(r"palette\.(\w+)", script))
    assert used == set(PALETTE)
    assert not re.search(r"#[0-9a-fA-F]{3,8}\b|rgb\(\d", script)
