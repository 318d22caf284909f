"""Write the report: one page with every table and figure."""

import _job
from _results import results_of


def report(job: _job.Job) -> None:
    from scenenet.experiments.published import read_thesis
    from scenenet.report import write_report

    thesis = read_thesis(job.input.thesis)
    write_report(results_of(job), thesis, job.output.report, failed=job.identity.get("failed", {}))


_job.run(report)
