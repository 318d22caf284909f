"""Put the rows of a contest's jobs into one table, in the order of the jobs."""

import adapter


def contest_runs(job: adapter.Job) -> None:
    import pandas as pd

    from scenenet.core.files import atomic
    from scenenet.results.folder import read_table

    with atomic(job.output.runs) as partial:
        pd.concat([read_table(runs) for runs in job.input.runs]).to_csv(partial, index=False)


adapter.run(contest_runs)
