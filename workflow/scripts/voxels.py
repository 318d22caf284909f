"""Voxelise each crop of a survey."""

import _job


def voxels(job: _job.Job) -> None:
    from scenenet.core.errors import in_file
    from scenenet.dataset.voxel_cache import build
    from scenenet.dataset.voxels import VoxelSettings

    with in_file(job.input.manifest):
        build(
            job.input.manifest,
            VoxelSettings(**job.settings),
            job.output.store,
            job.output.manifest,
            shapes=job.identity["shapes"],
        )


_job.run(voxels)
