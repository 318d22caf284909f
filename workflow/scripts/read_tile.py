"""Read a tile of a survey: its voxels and its points."""

import _job


def read_tile(job: _job.Job) -> None:
    from pathlib import Path

    from scenenet.core.files import read_json
    from scenenet.pointcloud.las.crs import named_system
    from scenenet.prediction.work.tiling import Layer
    from scenenet.prediction.work.work_file import PlannedFile, read_file

    given, planned = job.identity.get("crs"), job.identity["planned"]
    known, sizes = job.identity["input"]["tile"], read_json(job.input.voxel_size)
    read_file(
        Path(job.input.tile),
        job.identity["name"],
        job.output.work,
        sizes["voxel_size_m"],
        job.settings["chunk_points"],
        None if given is None else named_system(given),
        PlannedFile(None if known == _job.UNREADABLE else known, planned),
        [Layer(size) for size in sizes["further_m"]],
        classes=job.identity.get("classes", False),
    )


_job.run(read_tile)
