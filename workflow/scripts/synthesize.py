"""Make a synthetic survey."""

import adapter


def synthesize(job: adapter.Job) -> None:
    from scenenet.synthetic import SyntheticSettings, make_survey

    make_survey(
        SyntheticSettings(**job.settings),
        job.output.survey,
        truth=job.output.truth,
        towers=job.output.towers,
        progress=job.identity["name"],
    )


adapter.run(synthesize)
