"""Write the tables of thesis chapter 5, with the thesis' numbers beside this run's."""

import _job
from _results import results_of


def tables(job: _job.Job) -> None:
    from scenenet.experiments.published import read_thesis
    from scenenet.results.tables import write_tables
    from scenenet.results.thesis_comparison import write_comparison

    results, thesis = results_of(job), read_thesis(job.input.thesis)
    write_tables(results, thesis, results.folder / "tables")
    write_comparison(results, thesis, job.output.comparison)


_job.run(tables)
