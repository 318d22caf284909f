"""Find and measure the labelled towers of a survey."""

import _job


def towers(job: _job.Job) -> None:
    import sys

    from scenenet.core.files import atomic
    from scenenet.dataset.labelled_towers import TowerSettings, survey_towers

    codes, settings = job.identity["codes"], TowerSettings(**job.settings)
    found = survey_towers(job.input.survey, codes, settings)
    true = [survey_towers(path, codes, settings).towers for path in job.input.truth]
    for note in found.notes():
        print(f"{job.input.survey}: {note}", file=sys.stderr)
    for table, path in (
        (found.left_out, job.output.left_out),
        (found.towers, job.output.towers),
        (true[0] if true else found.towers[:0], job.output.true_towers),
    ):
        with atomic(path) as partial:
            table.to_csv(partial, index=False)


_job.run(towers)
