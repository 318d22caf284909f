"""Write the tables of thesis chapter 5, with the thesis' numbers beside ours."""

import adapter
from gathered import results_of


def tables(job: adapter.Job) -> None:
    from scenenet.published import read_thesis
    from scenenet.tables import write_tables

    results = results_of(job)
    write_tables(results, read_thesis(job.input.thesis), results.folder / "tables")


adapter.run(tables)
