"""Time the voxelisation of the crops on each grid of the thesis."""

import _job


def voxelisation_time(job: _job.Job) -> None:
    from scenenet.evaluation.voxelisation_time import time_grids

    time_grids(job.input.manifests, job.output.times)


_job.run(voxelisation_time)
