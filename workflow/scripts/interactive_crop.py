"""Export one test crop for the 3D view of the report."""

import _job
from _results import results_of


def interactive_crop(job: _job.Job) -> None:
    from scenenet.detection.settings import DetectionSettings
    from scenenet.figures.interactive_crop import write_interactive_crop

    write_interactive_crop(
        results_of(job),
        job.identity["model"],
        job.identity["rank"],
        job.output.crop,
        DetectionSettings(**job.settings),
    )


_job.run(interactive_crop)
