"""Find the spans and conductors of a survey of tiles."""

import _job


def conductors(job: _job.Job) -> None:
    from scenenet.detection.settings import DetectionSettings
    from scenenet.prediction.jobs.find_line import find_line_of
    from scenenet.prediction.survey_files import SurveyFiles
    from scenenet.review.rejected_conductors import RejectedConductors

    find_line_of(
        SurveyFiles.from_json(job.identity["survey"]),
        job.input.works,
        job.input.predictions,
        job.input.wires,
        job.input.towers,
        DetectionSettings(**job.settings),
        job.output.line,
        job.output.near,
        RejectedConductors.of(job.input.decisions),
    )


_job.run(conductors)
