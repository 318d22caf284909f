"""Join the runs of the jobs of an experiment into one table, in the order of the jobs."""

import _job


def join_runs(job: _job.Job) -> None:
    import pandas as pd

    from scenenet.core.files import atomic
    from scenenet.results.folder import read_table

    with atomic(job.output.runs) as partial:
        pd.concat([read_table(runs) for runs in job.input.runs]).to_csv(partial, index=False)


_job.run(join_runs)
