"""Voxelisation time of crops on the grids of the thesis (thesis 5.1.4)."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from scenenet.core.files import atomic, read_json
from scenenet.dataset.crops import read_crops
from scenenet.dataset.voxels import VoxelGrid, voxelise

if TYPE_CHECKING:
    import pandas as pd

RESOLUTIONS = (32, 64, 128)
"""Voxels per edge of the grids that the thesis times."""

MOST_CROPS = 400
"""Crops that are timed; of more, an even choice: their mean time changes little."""

COLUMNS = ("grid", "crop", "seconds", "occupied", "tower")


def time_grids(crop_manifests: Sequence[str | Path], out: str | Path) -> pd.DataFrame:
    """Voxelise crops on every grid and write a row for each.

    Args:
        crop_manifests: of the crop stores.
        out: CSV file with the columns ``COLUMNS``: seconds without reading files, number of
            occupied voxels and of tower voxels among them.

    Returns:
        the table in ``out``.
    """
    import pandas as pd

    rows: list[tuple[str, str, float, int, int]] = []
    n_crops = sum(len(read_json(manifest)["crops"]) for manifest in crop_manifests)
    step = max(1, math.ceil(n_crops / MOST_CROPS))
    for manifest in crop_manifests:
        for crop, cloud in read_crops(manifest, step):
            if not rows:  # the first call compiles
                voxelise(cloud, VoxelGrid.cube(cloud.xyz, RESOLUTIONS[0]), crop.id)
            for resolution in RESOLUTIONS:
                begin = time.perf_counter()
                sample = voxelise(cloud, VoxelGrid.cube(cloud.xyz, resolution), crop.id)
                seconds = time.perf_counter() - begin
                counts = len(sample.index), int(sample.labelled.sum())
                rows.append((f"cube-{resolution}", crop.id, seconds, *counts))
    table = pd.DataFrame(rows, columns=list(COLUMNS))
    with atomic(out) as partial:
        table.to_csv(partial, index=False, float_format="%.6g")
    return table
