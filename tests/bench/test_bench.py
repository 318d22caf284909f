"""The alternative implementations of the benchmark agree, and its result is complete."""

from __future__ import annotations

import json
import time

import numpy as np
import pytest
import torch

from scenenet.bench import BenchSettings, peers, tables
from scenenet.bench import measurements as sections
from scenenet.bench.crops import crops_in, synthetic_crops
from scenenet.bench.orbits import orbits
from scenenet.bench.timing import medians
from scenenet.convolution.convolve import convolve
from scenenet.core.errors import InputError
from scenenet.dataset.batches import batch
from scenenet.dataset.voxels import VoxelSettings, voxelise
from scenenet.models.scenenet import SceneNet
from scenenet.training.losses import VoxelWeights, fidelity


@pytest.fixture(scope="module")
def crops():
    return synthetic_crops(3)


@pytest.fixture(scope="module")
def samples(crops):
    return [
        voxelise(c, VoxelSettings(resolution=32).grid(c.xyz), f"{i}") for i, c in enumerate(crops)
    ]


@pytest.mark.parametrize("size", [(9, 9, 9), (9, 5, 5), (12, 5, 5), (4, 1, 6)])
def test_all_convolutions_give_the_same_result(samples, size):
    occupancy, _ = batch(samples[:1], "presence")
    kernels = torch.randn((3, *size), generator=torch.Generator().manual_seed(0))
    ours = convolve(occupancy, kernels.sum(0))
    for way in (peers.conv3d_summed, peers.conv3d_three, peers.fft_summed, peers.published_code):
        output = way(occupancy.dense(), kernels).float()
        torch.testing.assert_close(output, ours, rtol=1e-4, atol=1e-3)


def test_both_training_steps_have_the_same_error(samples):
    model = SceneNet(kernel_size=(5, 3, 3), generator=torch.Generator().manual_seed(1))
    occupancy, towers = batch(samples, "presence")
    kernel, _ = model.observer()
    dense = peers.dense_error(occupancy.dense(), kernel, towers, (0.2, 9.0))
    ours = fidelity(model, occupancy, towers, VoxelWeights(0.2, 9.0))
    torch.testing.assert_close(ours, dense)
    ours.backward()
    ours_gradient = [p.grad.clone() for p in model.parameters()]
    model.zero_grad()
    dense.backward()
    for a, b in zip(ours_gradient, [p.grad for p in model.parameters()], strict=True):
        torch.testing.assert_close(a, b, rtol=1e-4, atol=1e-6)


def test_both_voxelisations_find_the_same_voxels(crops):
    grid = VoxelSettings(resolution=32).grid(crops[0].xyz)
    sample = voxelise(crops[0], grid)
    counts, truth = peers.pandas_voxels(crops[0], grid)
    # A point on the border of two voxels may belong to either one, by rounding.
    assert abs(np.count_nonzero(counts) - len(sample.index)) <= 3
    assert abs(np.count_nonzero(truth) - int(sample.labelled.sum())) <= 1
    assert set(np.flatnonzero(truth)) >= set(sample.labelled_index()[:-1])


def test_medians_use_the_requested_runs_and_slow_tasks_run_once():
    calls = {"fast": 0, "slow": 0}

    def run(name, seconds=0.0):
        calls[name] += 1
        time.sleep(seconds)

    ways = {"fast": lambda: run("fast"), "slow": lambda: run("slow", 1.05)}
    times = medians(ways, repetitions=2, most_seconds=0.5)
    assert calls["slow"] == 1
    assert calls["fast"] > 2
    assert times["fast"] < times["slow"]
    assert times["slow"] >= 1050


def test_the_result_has_the_keys_that_the_report_reads(samples, crops, monkeypatch):
    monkeypatch.setattr(sections, "SIZES", ((9, 5, 5),))
    monkeypatch.setattr(sections, "RESOLUTIONS", (32,))
    section = sections.convolution({32: samples}, repetitions=2)
    entry = section["32"]["9x5x5"]
    assert entry.keys() >= {
        "ours_ms", "conv3d_f32_ms", "fft_ms", "reference_ms", "speedup_vs_conv3d",
        "speedup_vs_reference",
    }  # fmt: skip
    assert all(value > 0 for value in entry.values())
    assert entry["difference"] < 1e-5
    assert entry["speedup_vs_conv3d"] == pytest.approx(entry["conv3d_f32_ms"] / entry["ours_ms"])
    slope = sections.gradient({32: samples})["32"]["9x5x5"]
    assert slope["ratio_to_forward"] == pytest.approx(slope["ours_ms"] / slope["forward_ms"])
    voxels = sections.voxelisation(crops)["32"]
    assert voxels["speedup"] == pytest.approx(voxels["pandas_ms"] / voxels["ours_ms"])
    machine = sections.machine()
    assert machine["threads"] >= 1
    result = {
        "convolution": section,
        "machine": machine,
        "crops": [{"points": 1, "occupied_64": 2, "occupied_128": 3}],
    }
    json.dumps(result)
    assert sum("9x5x5" in line for line in tables(result)) == 1


def test_a_folder_without_samples_is_named(tmp_path):
    with pytest.raises(InputError, match=str(tmp_path)):
        sections.bench(BenchSettings(crops=tmp_path))
    with pytest.raises(InputError, match="not a folder"):
        crops_in(tmp_path / "none", "edp")


def test_an_orbit_gives_the_maximum_of_its_kernels(crops):
    found = orbits(crops[:1], repetitions=1)
    assert found.keys() == {"line", "ground"}
    assert found["line"]["kernels"] == 224
    assert all(entry["difference"] < 1e-4 for entry in found.values())
    assert all(entry["each_ms"] > entry["one_ms"] > 0 for entry in found.values())
