"""Fail if a tile of a survey is not predicted, and say why."""

import _job


def survey_complete(job: _job.Job) -> None:
    from scenenet.core.files import read_json, write_json
    from scenenet.prediction.jobs.complete import require_all_predicted

    files = read_json(job.input.summary)["files"]
    require_all_predicted(files, job.input.status)
    write_json(job.output.complete, {"tiles": len(files)})


_job.run(survey_complete)
