"""Inference time on crops of the test part, and the peak memory of a process."""

from __future__ import annotations

import time
from types import SimpleNamespace

import numpy as np
import pytest

from scenenet.core.errors import InputError
from scenenet.core.peak_memory import used
from scenenet.evaluation.inference_time import RESOLUTIONS, milliseconds, time_model
from scenenet.models.model_file import write_model


def test_the_time_is_the_median_over_samples_without_the_first_call():
    seen: dict[float, int] = {}

    def predict(sample):
        calls = seen[sample.seconds] = seen.get(sample.seconds, 0) + 1
        time.sleep(0.2 if calls == 1 else sample.seconds)
        return np.zeros(1), np.zeros(1, bool)

    samples = [SimpleNamespace(seconds=s) for s in (0.005, 0.02, 0.06)]
    took = milliseconds(predict, samples, repeats=3)
    assert 20 <= took < 55
    assert list(seen.values()) == [4, 4, 4]


@pytest.fixture
def model(pole_finder, tmp_path):
    path = tmp_path / "model.json"
    write_model(path, *pole_finder)
    return path


def test_a_model_is_timed_on_both_grids(dataset_files, model):
    found = time_model(model, [dataset_files.crops], dataset_files.split)
    assert list(found["inference_ms"]) == [str(n) for n in RESOLUTIONS]
    assert all(ms > 0 for ms in found["inference_ms"].values())
    assert found["crops"] == 3


def test_without_test_crops_there_is_nothing_to_time(dataset_files, model, tmp_path):
    split = tmp_path / "split.csv"
    split.write_text("survey,crop,stretch,part\n")
    with pytest.raises(InputError, match="no crop is in the test part"):
        time_model(model, [dataset_files.crops], split)


def test_memory_that_is_taken_raises_the_peak():
    before = used()["peak_memory_mb"]
    block = np.ones(round((before + 200) * 1e6) // 8 + 1)
    after = used()["peak_memory_mb"]
    assert after > before + 150
    assert block.sum() > 0
