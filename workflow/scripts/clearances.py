"""Measure what is near the conductors of a survey of tiles."""

import _job


def clearances(job: _job.Job) -> None:
    from scenenet.clearance.settings import ClearanceSettings
    from scenenet.pointcloud.class_schemes import class_scheme
    from scenenet.prediction.jobs.find_line import find_clearances_of
    from scenenet.prediction.survey_files import SurveyFiles

    find_clearances_of(
        SurveyFiles.from_json(job.identity["survey"]),
        job.input.works,
        job.input.wires,
        job.input.line,
        ClearanceSettings(**job.settings),
        class_scheme(job.identity["codes"]),
        job.output.clearances,
    )


_job.run(clearances)
