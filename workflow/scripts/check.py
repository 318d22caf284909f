"""Report what is in a survey, and its faults."""

import _job


def check(job: _job.Job) -> None:
    from scenenet.core.files import atomic, write_json
    from scenenet.pointcloud.quality.check import CheckSettings, check_survey

    report = check_survey(job.input.survey, job.identity["codes"], CheckSettings(**job.settings))
    write_json(job.output.report, report.to_json())
    with atomic(job.output.classes) as partial:
        report.classes.to_csv(partial, index=False)


_job.run(check)
