"""Write the tables of the dataset (thesis 5.1), with the thesis' numbers beside this run's."""

import _job
from _results import results_of


def dataset_tables(job: _job.Job) -> None:
    from scenenet.experiments.published import read_thesis
    from scenenet.results.tables import DATASET_TABLES, write_tables

    results, thesis = results_of(job), read_thesis(job.input.thesis)
    write_tables(results, thesis, results.folder / "tables", DATASET_TABLES)


_job.run(dataset_tables)
