"""Find and measure the labelled towers of a survey."""

import _job


def towers(job: _job.Job) -> None:
    from scenenet.core.files import atomic
    from scenenet.dataset.labelled_towers import TowerSettings, survey_towers

    table = survey_towers(job.input.survey, job.identity["codes"], TowerSettings(**job.settings))
    with atomic(job.output.towers) as partial:
        table.to_csv(partial, index=False)


_job.run(towers)
