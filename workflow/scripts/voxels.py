"""Lay a grid over each crop of a survey."""

import adapter


def voxels(job: adapter.Job) -> None:
    from scenenet.voxel_store import build
    from scenenet.voxels import VoxelSettings

    build(job.input.manifest, VoxelSettings(**job.settings), job.output.store, job.output.manifest)


adapter.run(voxels)
