"""Write the tables of thesis chapter 5, with the thesis' numbers beside this run's."""

import _job
from _results import results_of


def tables(job: _job.Job) -> None:
    from pathlib import Path

    from scenenet.core.files import write_json
    from scenenet.experiments.published import read_thesis
    from scenenet.results.tables import DATASET_TABLES, TABLES, digest_scores, write_tables
    from scenenet.results.thesis_comparison import write_comparison

    results, thesis = results_of(job), read_thesis(job.input.thesis)
    folder = results.folder / "tables"
    made = [name for name in TABLES if name not in DATASET_TABLES]
    written = write_tables(results, thesis, folder, made)
    comparisons = [Path(path) for path in job.output.comparisons]
    write_comparison(results, thesis, *comparisons)
    names = [*DATASET_TABLES, *(path.stem for path in (*written, *comparisons))]
    write_json(job.output.scores, digest_scores(folder, names))


_job.run(tables)
