"""Say in which voxels the model that predicts observes a survey."""

import _job


def voxel_size(job: _job.Job) -> None:
    from scenenet.core.files import write_json
    from scenenet.prediction.jobs.predict_tile import model_voxel_size
    from scenenet.prediction.settings import PredictSettings

    size = model_voxel_size(job.input.model, PredictSettings(**job.settings))
    write_json(job.output.voxel_size, {"voxel_size_m": size})


_job.run(voxel_size)
