"""Lay a grid over each crop of a survey."""

import adapter


def voxels(job: adapter.Job) -> None:
    from scenenet.dataset.voxel_cache import build
    from scenenet.dataset.voxels import VoxelSettings

    build(job.input.manifest, VoxelSettings(**job.settings), job.output.store, job.output.manifest)


adapter.run(voxels)
