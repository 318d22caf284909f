"""Find the towers of a survey of tiles."""

import _job


def find_towers(job: _job.Job) -> None:
    from scenenet.detection.settings import DetectionSettings
    from scenenet.prediction.jobs.find_towers import find_towers_of
    from scenenet.prediction.survey_files import SurveyFiles

    find_towers_of(
        SurveyFiles.from_json(job.identity["survey"]),
        job.input.works,
        job.input.predictions,
        job.input.model,
        DetectionSettings(**job.settings),
        job.output.towers,
        job.output.near,
    )


_job.run(find_towers)
