"""Say in which voxels the models that predict observe a survey."""

import _job


def voxel_size(job: _job.Job) -> None:
    from scenenet.core.files import write_json
    from scenenet.prediction.jobs.predict_tile import further_voxel_sizes, model_voxel_size
    from scenenet.prediction.settings import PredictSettings

    settings = PredictSettings(**job.settings)
    size = model_voxel_size(job.input.model, settings)
    further = further_voxel_sizes(job.identity["observers"], size, settings)
    write_json(job.output.voxel_size, {"voxel_size_m": size, "further_m": further})


_job.run(voxel_size)
