"""Export test crops for the 3D view of the report."""

import _job
from _results import results_of


def interactive_crop(job: _job.Job) -> None:
    from scenenet.detection.settings import DetectionSettings
    from scenenet.figures.interactive_crop import write_interactive_crop

    results, detection = results_of(job), DetectionSettings(**job.settings)
    for rank, file in zip(job.identity["ranks"], job.output.crops, strict=True):
        write_interactive_crop(results, job.identity["model"], rank, file, detection)


_job.run(interactive_crop)
