"""Time how crops become voxels on each grid of the thesis."""

import adapter


def grid_times(job: adapter.Job) -> None:
    from scenenet.evaluation.voxelisation_time import time_grids

    time_grids(job.input.manifests, job.output.times)


adapter.run(grid_times)
