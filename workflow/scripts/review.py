"""Merge what people decided about the towers of a survey."""

from pathlib import Path

import _job


def review(job: _job.Job) -> None:
    from scenenet.review.review_survey import review_survey

    folder = Path(job.output.record).parent
    review_survey(job.input.table, job.input.decisions, folder)


_job.run(review)
