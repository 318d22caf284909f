"""Inference time of a model for a crop (thesis 5.2.6)."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from scenenet.core.errors import InputError
from scenenet.core.progress import track
from scenenet.dataset.crops import read_crops
from scenenet.dataset.split import crops_in
from scenenet.dataset.voxels import VoxelGrid, VoxelSample, voxelise
from scenenet.models.model_file import read_model
from scenenet.models.predictions import probabilities

RESOLUTIONS = (64, 128)
"""Voxels per edge: the grid of the thesis, and the finer one of thesis 5.2.7."""
CROPS = 6
"""Number of timed crops, the first of the test part by name."""
REPEATS = 5

Predict = Callable[[VoxelSample], tuple[np.ndarray, np.ndarray]]


def time_model(
    model: str | Path, crop_manifests: Sequence[str | Path], split: str | Path
) -> dict[str, Any]:
    """The time that a tuned model takes for a test crop on each grid of ``RESOLUTIONS``.

    Returns:
        model, seed, crops (their number) and ``inference_ms``: voxels per edge -> median, ms.

    Raises:
        InputError: no crop is in the test part.
    """
    trained, card = read_model(model)
    names = sorted(crops_in(split, "test"))[:CROPS]
    clouds = {
        crop.id: cloud
        for manifest in crop_manifests
        for crop, cloud in read_crops(manifest)
        if crop.id in names
    }
    if not clouds:
        raise InputError("no crop is in the test part", file=split)

    def predict(sample: VoxelSample) -> tuple[np.ndarray, np.ndarray]:
        return probabilities(trained, sample, card.measurement)

    inference_ms = {}
    for resolution in track(RESOLUTIONS, f"{card.name}: grids timed"):
        samples = [
            voxelise(cloud, VoxelGrid.cube(cloud.xyz, resolution), name)
            for name, cloud in sorted(clouds.items())
        ]
        inference_ms[str(resolution)] = milliseconds(predict, samples)
    return {
        "model": card.name,
        "seed": card.provenance.get("seed"),
        "crops": len(clouds),
        "inference_ms": inference_ms,
    }


def milliseconds(predict: Predict, samples: Sequence[VoxelSample], repeats: int = REPEATS) -> float:
    """Time from occupied voxels to the probability of every voxel, ms: the median over samples of
    the median over repeats. The first call for each sample, which may compile, does not count."""
    medians = []
    for sample in samples:
        predict(sample)
        times = []
        for _ in range(repeats):
            begin = time.perf_counter()
            predict(sample)
            times.append(1e3 * (time.perf_counter() - begin))
        medians.append(median(times))
    return median(medians)
