"""Join the runs and the times of the jobs of an experiment, in the order of the jobs."""

import _job


def join_runs(job: _job.Job) -> None:
    import pandas as pd

    from scenenet.core.files import atomic
    from scenenet.results.result_files import read_table

    for name in ("runs", "times"):
        tables = [read_table(path) for path in getattr(job.input, name)]
        with atomic(getattr(job.output, name)) as partial:
            pd.concat(tables).to_csv(partial, index=False)


_job.run(join_runs)
