"""The crops that the benchmark runs on: synthetic ones or the user's own."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from scenenet.core.errors import InputError
from scenenet.pointcloud import PointCloud, read
from scenenet.pointcloud.ts40k import sample_files


def synthetic_crops(n: int, seed: int = 0) -> list[PointCloud]:
    """``n`` crops of a synthetic line, each with the points within one tower height."""
    from scenenet.synthetic import SyntheticSettings, corridor_cloud

    cloud, _, towers = corridor_cloud(SyntheticSettings(towers=n, seed=seed))
    crops = []
    for tower in towers:
        apart = np.hypot(cloud.xyz[:, 0] - tower.x, cloud.xyz[:, 1] - tower.y)
        crops.append(cloud.select(apart <= tower.height))
    return crops


def crops_in(folder: Path, codes: str) -> list[PointCloud]:
    """The samples of a folder (TS40K .npy or .pt), ordered by name.

    Args:
        codes: class scheme of the labels.

    Raises:
        InputError: the folder or a sample cannot be read, or there is no sample.
    """
    if not folder.is_dir():
        raise InputError("not a folder", file=folder, remedy="Name a folder of .npy or .pt samples")
    return [read(file, codes=codes) for file in sample_files(folder)]
