"""Classify a survey and list its towers."""

import adapter


def predict(job: adapter.Job) -> None:
    from scenenet.detection import DetectionSettings
    from scenenet.inference import PredictSettings, predict_survey

    predict_survey(
        job.input.survey,
        job.input.model,
        job.output.survey,
        job.output.towers,
        job.output.summary,
        PredictSettings(**job.settings),
        DetectionSettings(**job.identity["detection"]),
    )


adapter.run(predict)
