"""Count the points in the fullest voxel of a survey of tiles."""

import _job


def fullest_voxel(job: _job.Job) -> None:
    from scenenet.core.files import write_json
    from scenenet.prediction.jobs.joined import fullest_in
    from scenenet.prediction.survey_files import SurveyFiles

    survey = SurveyFiles.from_json(job.identity["survey"])
    points = fullest_in(survey, job.input.works, job.input.model)
    write_json(job.output.fullest, {"points": points})


_job.run(fullest_voxel)
