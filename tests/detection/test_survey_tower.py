"""The tower list in a file and back."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from fixtures.sound_tower import SOUND_TOWER

from scenenet.core.errors import InputError
from scenenet.detection.survey_tower import TOWER_COLUMNS, SurveyTower, read_towers

TOWER = replace(
    SOUND_TOWER,
    id=1,
    x=512_000.25,
    y=4_630_000.5,
    height=31.5,
    base=104.25,
    width=2.5,
    conductor_directions=2,
    conductor_bearings=(12.5, 190.0),
    probability=0.97,
    points=812,
    edge_distance=50.0,
    contributions={"cylinder": 0.75, "arrow": 0.5, "negative_sphere": -0.25},
)


def written(path: Path, towers: list[SurveyTower]) -> Path:
    features = [tower.to_feature((tower.x, tower.y)) for tower in towers]
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    return path


def test_a_tower_list_is_read_as_it_was_written(tmp_path):
    towers = [TOWER, replace(TOWER, id=2, x=512_300.0, conductor_bearings=())]
    assert read_towers(written(tmp_path / "list.geojson", towers)) == towers


def test_a_list_without_towers_is_empty(tmp_path):
    assert read_towers(written(tmp_path / "list.geojson", [])) == []


@pytest.mark.parametrize("column", [c.name for c in TOWER_COLUMNS])
def test_a_list_that_lacks_a_column_is_refused_with_its_name(tmp_path, column):
    path = written(tmp_path / "list.geojson", [TOWER])
    collection = json.loads(path.read_text())
    del collection["features"][0]["properties"][column]
    path.write_text(json.dumps(collection))
    with pytest.raises(InputError, match=rf"list\.geojson: .*'{column}'"):
        read_towers(path)


@pytest.mark.parametrize("content", ["towers", "[]", "{}", '{"features": 3}'])
def test_a_file_that_is_no_tower_list_is_refused(tmp_path, content):
    path = tmp_path / "list.geojson"
    path.write_text(content)
    with pytest.raises(InputError, match=r"list\.geojson: not a tower list"):
        read_towers(path)


def test_a_missing_list_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"list\.geojson: No such file"):
        read_towers(tmp_path / "list.geojson")
