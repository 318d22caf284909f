"""Write the tables of thesis chapter 5, with the thesis' numbers beside ours."""

import adapter
from gathered import results_of


def tables(job: adapter.Job) -> None:
    from scenenet.comparison import write_comparison
    from scenenet.published import read_thesis
    from scenenet.tables import write_tables

    results, thesis = results_of(job), read_thesis(job.input.thesis)
    write_tables(results, thesis, results.folder / "tables")
    write_comparison(results, thesis, job.output.comparison)


adapter.run(tables)
