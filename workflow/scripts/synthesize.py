"""Make a synthetic survey."""

import _job


def synthesize(job: _job.Job) -> None:
    from scenenet.synthetic import SyntheticSettings, make_survey

    make_survey(
        SyntheticSettings(**job.settings),
        job.output.survey,
        truth=job.output.truth,
        towers=job.output.towers,
        progress=job.identity["name"],
    )


_job.run(synthesize)
