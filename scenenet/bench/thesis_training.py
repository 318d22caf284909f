"""The training of the thesis at its scale: 565 crops and 50 epochs (thesis 5.2.1, 5.2.6)."""

from __future__ import annotations

import time
from typing import Any

from scenenet.bench.crops import synthetic_crops
from scenenet.core.progress import track
from scenenet.dataset.voxels import VoxelSettings, voxelise
from scenenet.models.settings import ModelSettings
from scenenet.training.train import fit

CROPS = 565
"""Number of training crops in the thesis: a fifth of 2823 (thesis 5.2.1)."""
CROPS_PER_LINE = 20
"""Crops of one synthetic line. Several short lines need less memory than one long line."""
THESIS_MINUTES = 85.0
"""Training time in the thesis, on an RTX 3070 (thesis 5.2.6)."""


def thesis_training() -> dict[str, Any]:
    """Time one training of SCENE-Net on 565 synthetic crops at 64^3 with 9x9x9 kernels.

    As in the thesis only the training counts, from the grids to the last epoch.

    Returns:
        crops, epochs, seconds, ms_per_step, thesis_minutes and speedup_vs_thesis_gpu.
    """
    samples = []
    for first in track(range(0, CROPS, CROPS_PER_LINE), "thesis: crops generated"):
        for i, crop in enumerate(synthetic_crops(min(CROPS_PER_LINE, CROPS - first), seed=first)):
            grid = VoxelSettings(resolution=64).grid(crop.xyz)
            samples.append(voxelise(crop, grid, f"{first + i}"))
    settings = ModelSettings(name="thesis", kind="scenenet")
    begin = time.perf_counter()
    _, history = fit(samples, [], settings, seed=0)
    seconds = time.perf_counter() - begin
    return {
        "crops": len(samples),
        "epochs": len(history),
        "seconds": seconds,
        "ms_per_step": 1e3 * seconds / (len(history) * -(-len(samples) // 8)),
        "thesis_minutes": THESIS_MINUTES,
        "speedup_vs_thesis_gpu": 60 * THESIS_MINUTES / seconds,
    }
