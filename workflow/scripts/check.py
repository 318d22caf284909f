"""Report what is in a survey, and its faults."""

import _job


def check(job: _job.Job) -> None:
    from scenenet.core.files import atomic, write_json
    from scenenet.pointcloud.las.crs import named_system
    from scenenet.pointcloud.quality.check import CheckSettings, check_survey

    given = job.identity.get("crs")
    crs = None if given is None else named_system(given)
    settings = CheckSettings(**job.settings)
    report = check_survey(job.input.survey, job.identity["codes"], settings, crs)
    write_json(job.output.report, report.to_json())
    with atomic(job.output.classes) as partial:
        report.classes.to_csv(partial, index=False)


_job.run(check)
