"""Voxelise each crop of a survey."""

import _job


def voxels(job: _job.Job) -> None:
    from scenenet.dataset.voxel_cache import build
    from scenenet.dataset.voxels import VoxelSettings

    build(job.input.manifest, VoxelSettings(**job.settings), job.output.store, job.output.manifest)


_job.run(voxels)
