"""Write the tables of thesis chapter 5, with the thesis' numbers beside this run's."""

import _job
from _results import results_of


def tables(job: _job.Job) -> None:
    from pathlib import Path

    from scenenet.core.files import write_json
    from scenenet.experiments.published import read_thesis
    from scenenet.results.claims.table import write_claims
    from scenenet.results.published_numbers import write_published_numbers
    from scenenet.results.tables import DATASET_TABLES, TABLES, digest_scores, write_tables

    results, thesis = results_of(job), read_thesis(job.input.thesis)
    folder = results.folder / "tables"
    made = [name for name in TABLES if name not in DATASET_TABLES]
    written = write_tables(results, thesis, folder, made)
    comparisons = [Path(path) for path in job.output.comparisons]
    write_claims(results, thesis, *comparisons[:2])
    write_published_numbers(results, thesis, *comparisons[2:])
    names = [*DATASET_TABLES, *(path.stem for path in (*written, *comparisons))]
    write_json(job.output.scores, digest_scores(folder, names))


_job.run(tables)
