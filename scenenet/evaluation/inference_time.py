"""How long a model takes to answer a crop (thesis 5.2.6)."""

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
"""Voxels an edge: the thesis' grid, and the finer one of its 5.2.7."""
CROPS = 6
"""Crops that are timed; the first ones of the test part by name."""
REPEATS = 5

Answer = Callable[[VoxelSample], tuple[np.ndarray, np.ndarray]]


def time_model(
    model: str | Path, crop_manifests: Sequence[str | Path], split: str | Path
) -> dict[str, Any]:
    """The time a tuned model takes for a test crop on each grid of ``RESOLUTIONS``.

    Returns:
        model, seed, crops (number of them) and ``inference_ms``: voxels an edge -> median, ms.

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

    def answer(sample: VoxelSample) -> tuple[np.ndarray, np.ndarray]:
        return probabilities(trained, sample, card.measurement)

    took = {}
    for resolution in track(RESOLUTIONS, f"{card.name}: grids timed"):
        samples = [
            voxelise(cloud, VoxelGrid.cube(cloud.xyz, resolution), name)
            for name, cloud in sorted(clouds.items())
        ]
        took[str(resolution)] = milliseconds(answer, samples)
    return {
        "model": card.name,
        "seed": card.provenance.get("seed"),
        "crops": len(clouds),
        "inference_ms": took,
    }


def milliseconds(answer: Answer, samples: Sequence[VoxelSample], repeats: int = REPEATS) -> float:
    """From occupied voxels to the probability of every voxel: median over samples of the median
    over repeats, ms. A first call of each, which may compile or fill a cache, does not count."""
    of_samples = []
    for sample in samples:
        answer(sample)
        took = []
        for _ in range(repeats):
            begin = time.perf_counter()
            answer(sample)
            took.append(1e3 * (time.perf_counter() - begin))
        of_samples.append(median(took))
    return median(of_samples)
