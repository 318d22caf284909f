"""Small crops to train on."""

from __future__ import annotations

import pytest

from scenenet.dataset.voxels import VoxelGrid, VoxelSample, voxelise


@pytest.fixture(scope="session")
def pole_crops(scene):
    """A function that makes four crops of 20 m with a pole and a tree each, of given voxel sizes in
    m."""

    def make(sizes: tuple[float, ...] = (1.0,) * 4) -> list[VoxelSample]:
        clouds = [
            scene(((8.5 + i, 9.5),), size=(20, 20), tree=(14, 4 + i), seed=i)
            for i in range(len(sizes))
        ]
        grids = [VoxelGrid.metric(c.xyz, size) for c, size in zip(clouds, sizes, strict=True)]
        named = enumerate(zip(clouds, grids, strict=True))
        return [voxelise(cloud, grid, f"pole-{i}") for i, (cloud, grid) in named]

    return make
