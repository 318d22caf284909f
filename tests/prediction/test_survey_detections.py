"""The detected voxels of a survey, read area by area, are those read at once."""

from __future__ import annotations

import numpy as np
import pytest
from fixtures.spools import spool_of

from scenenet.detection.candidates import axes
from scenenet.detection.detected_voxels import DetectedVoxels
from scenenet.detection.settings import DetectionSettings
from scenenet.prediction import survey_detections
from scenenet.prediction.survey_detections import SurveyDetections
from scenenet.prediction.work.block_file import BlockFile, BlockWriter
from scenenet.prediction.work.lattice import code_of
from scenenet.prediction.work.tile_predictions import (
    PREDICTED_KINDS,
    TilePrediction,
    TilePredictions,
)

THRESHOLD = 0.7


@pytest.fixture
def survey(tmp_path):
    """(spool, predictions) of points over 60 tiles, with a random probability in each voxel."""
    random = np.random.default_rng(0)
    xyz = random.uniform([-100, -30, -10], [500, 150, 15], (60_000, 3))
    xyz += [500_000, 4_630_000, 100]
    spool = spool_of(tmp_path / "work", 1.0, [xyz])
    with (tmp_path / "predictions").open("wb") as stream:
        blocks = BlockWriter(stream, PREDICTED_KINDS)
        for tile in spool.tiles():
            n = len(tile.voxel)
            probability = random.random(n).astype(np.float32)
            shares = random.random((n, 2)).astype(np.float32)
            prediction = TilePrediction(tile.voxel, probability, shares)
            blocks.add("predictions", code_of(tile.place), prediction.records())
        blocks.end({"geneos": ["a", "b"], "target": "tower", "tau": 0.9, "voxel_size": 1.0})
    return spool, TilePredictions([BlockFile(tmp_path / "predictions")])


@pytest.mark.parametrize("area_tiles", [1, 3, 16])
def test_areas_give_what_all_voxels_give_at_once(survey, area_tiles, monkeypatch):
    monkeypatch.setattr(survey_detections, "AREA_TILES", area_tiles)
    spool, predictions = survey
    codes = [code for code, _ in spool.places()]
    zyx, probability, shares = predictions.detected(THRESHOLD, codes)
    at_once = DetectedVoxels(spool.centres(zyx), probability, spool.voxel_size)
    in_areas = SurveyDetections(spool, predictions, THRESHOLD)
    assert np.array_equal(in_areas.offset, at_once.offset)
    found = axes(in_areas, DetectionSettings(), 3.0)
    assert len(found) > 100
    assert np.array_equal(found, axes(at_once, DetectionSettings(), 3.0))
    for place in found[::40]:
        rows = at_once.within(place, 7.0)
        near = in_areas.around(place, 7.0)
        own = near.within(place, 7.0)
        assert np.array_equal(near.z[own], at_once.z[rows])
        assert np.array_equal(near.probability[own], at_once.probability[rows])
        assert np.array_equal(in_areas.shares(place, 7.0), shares[rows])


def test_a_survey_without_detected_voxels_has_no_area(survey):
    spool, predictions = survey
    none = SurveyDetections(spool, predictions, 1.5)
    assert list(none.areas(100.0)) == []
    assert axes(none, DetectionSettings(), 3.0).shape == (0, 2)
