"""Write a review file with every tower of a survey, the doubtful ones first."""

from pathlib import Path

import _job


def review_template(job: _job.Job) -> None:
    from scenenet.review.found_list import find_list
    from scenenet.review.template import write_template

    write_template(Path(job.output.template), find_list(job.input.table))


_job.run(review_template)
