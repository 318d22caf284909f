"""The files of a synthetic survey."""

from __future__ import annotations

import json
import tracemalloc

import numpy as np
import pytest

from scenenet.core.errors import InputError
from scenenet.pointcloud import read
from scenenet.synthetic import SyntheticSettings, corridor_cloud, make_corridor, make_survey
from scenenet.synthetic.survey import space_needed


def test_truth_file_has_the_same_points_in_the_same_order(small, tmp_path):
    out, truth, towers = (tmp_path / n for n in ("s.laz", "s.truth.laz", "s.towers.geojson"))
    settings = small()
    summary = make_survey(settings, out, truth, towers)
    a, b = read(out, codes="edp"), read(truth, codes="edp")
    cloud, true_classes, listed = corridor_cloud(settings)
    assert summary["points"] == len(a) == len(b) == len(cloud)
    np.testing.assert_array_equal(a.xyz, b.xyz)
    np.testing.assert_allclose(a.xyz, cloud.xyz, atol=0.0006)
    np.testing.assert_array_equal(a.classification, cloud.classification)
    np.testing.assert_array_equal(b.classification, true_classes)
    assert a.crs.to_epsg() == 32629
    collection = json.loads(towers.read_text())
    assert collection["crs"]["properties"]["name"].endswith("32629")
    assert [f["properties"]["type"] for f in collection["features"]] == [t.type for t in listed]
    first = collection["features"][0]
    assert set(first["properties"]) == {"id", "x", "y", "base", "height", "type"}
    assert first["geometry"]["coordinates"] == [first["properties"]["x"], first["properties"]["y"]]


def test_summary_counts_what_is_in_the_file(small, tmp_path):
    settings = small()
    summary = make_survey(settings, tmp_path / "s.laz")
    cloud, truth, towers = corridor_cloud(settings)
    codes, counts = np.unique(cloud.classification, return_counts=True)
    assert summary["classes"] == dict(zip(codes.tolist(), counts.tolist(), strict=True))
    assert summary["towers"] == len(towers)
    assert summary["mislabelled"] == pytest.approx((truth[cloud.is_tower] != 15).mean(), abs=1e-4)


def test_the_estimate_of_space_holds_the_survey_and_is_not_far_above(small, tmp_path):
    for settings in (small(), SyntheticSettings(towers=3, seed=1)):
        for name in ("s.laz", "s.las"):
            make_survey(settings, tmp_path / name)
            written = (tmp_path / name).stat().st_size
            estimate = space_needed(make_corridor(settings), tmp_path / name)
            assert written <= estimate <= 5 * written


def test_number_of_workers_does_not_change_the_bytes(small, tmp_path):
    settings = small(towers=5, section=2, margin=0.5)
    files = [tmp_path / f"{workers}.laz" for workers in (1, 2, 4)]
    for workers, file in zip((1, 2, 4), files, strict=True):
        make_survey(settings, file, workers=workers)
    assert files[0].read_bytes() == files[1].read_bytes() == files[2].read_bytes()


@pytest.mark.parametrize("workers", [1, 2])
def test_memory_does_not_grow_with_the_line(small, tmp_path, workers):
    def peak(towers: int) -> tuple[int, int]:
        tracemalloc.start()
        summary = make_survey(small(towers=towers), tmp_path / "s.laz", workers=workers)
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return most, summary["points"]

    peak(2)  # compiles
    # Long enough that both workers reach their largest memory.
    (short, few), (long, many) = peak(12), peak(60)
    assert many > 4 * few
    assert long < 1.5 * short


def test_a_failure_half_way_leaves_no_file(small, tmp_path, monkeypatch):
    corridor_type = type(make_corridor(small()))
    whole = corridor_type.stretch

    def breaks(self, index):
        if index == 2:
            raise RuntimeError("out of paper")
        return whole(self, index)

    monkeypatch.setattr(corridor_type, "stretch", breaks)
    with pytest.raises(RuntimeError, match="out of paper"):
        make_survey(small(), tmp_path / "s.laz", tmp_path / "t.laz")
    assert list(tmp_path.iterdir()) == []


def test_other_suffixes_are_refused(small, tmp_path):
    with pytest.raises(InputError, match=r"\.xyz"):
        make_survey(small(), tmp_path / "s.xyz")
