"""Predict a tile of a survey, with its neighbours as surroundings."""

import _job


def predict_tile(job: _job.Job) -> None:
    from scenenet.core.files import read_json
    from scenenet.prediction.jobs import predict_tile as stage
    from scenenet.prediction.settings import PredictSettings

    fullest = [read_json(path)["points"] for path in job.input.fullest]
    stage.predict_tile(
        job.input.work,
        job.input.neighbours,
        job.input.model,
        job.output.predictions,
        job.identity["within"],
        fullest[0] if fullest else None,
        PredictSettings(**job.settings),
    )


_job.run(predict_tile)
