"""Write the tower list, the status and the summary of a survey of tiles."""

import _job


def survey_lists(job: _job.Job) -> None:
    from pathlib import Path

    from scenenet.detection.settings import DetectionSettings
    from scenenet.prediction.jobs.write_lists import write_lists
    from scenenet.prediction.result_files import PredictionFiles
    from scenenet.prediction.settings import PredictSettings
    from scenenet.prediction.survey_files import SurveyFiles

    survey = SurveyFiles.from_json(job.identity["survey"])
    write_lists(
        survey,
        job.input.works,
        job.input.predictions,
        job.input.towers,
        job.input.written,
        job.input.model,
        PredictionFiles.of(survey, Path(job.output.summary).parent),
        PredictSettings(**job.settings),
        DetectionSettings(**job.identity["detection"]),
    )


_job.run(survey_lists)
