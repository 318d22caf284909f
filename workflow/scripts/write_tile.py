"""Write the points of a tile of a survey, classified."""

import _job


def write_tile(job: _job.Job) -> None:
    from scenenet.pointcloud.class_schemes import class_scheme
    from scenenet.pointcloud.las.crs import named_system
    from scenenet.prediction.jobs import write_tile as stage
    from scenenet.prediction.settings import PredictSettings

    given, codes = job.identity.get("crs"), job.identity.get("codes")
    stage.write_tile(
        job.input.work,
        job.input.predictions,
        job.input.near,
        job.output.points,
        job.output.record,
        PredictSettings(**job.settings),
        None if given is None else named_system(given),
        job.identity["input"]["tile"],
        scheme=None if codes is None else class_scheme(codes),
    )


_job.run(write_tile)
