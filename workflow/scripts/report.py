"""Write the page with every table and figure."""

import adapter
from gathered import results_of


def report(job: adapter.Job) -> None:
    from scenenet.experiments.published import read_thesis
    from scenenet.report import write_report

    thesis = read_thesis(job.input.thesis)
    write_report(results_of(job), thesis, job.output.report)


adapter.run(report)
