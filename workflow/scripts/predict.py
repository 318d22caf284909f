"""Classify a survey and list its towers."""

import _job


def predict(job: _job.Job) -> None:
    from scenenet.detection.settings import DetectionSettings
    from scenenet.prediction.settings import PredictSettings
    from scenenet.prediction.writers import predict_to_files

    predict_to_files(
        job.input.survey,
        job.input.model,
        job.output.survey,
        job.output.towers,
        job.output.summary,
        PredictSettings(**job.settings),
        DetectionSettings(**job.identity["detection"]),
    )


_job.run(predict)
