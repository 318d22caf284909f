"""Register the best seed of each model, and the best model, in MLflow."""

import _job
from _results import results_of


def register(job: _job.Job) -> None:
    from scenenet.tracking.registry import register_champions
    from scenenet.tracking.store import TrackingSettings

    settings = TrackingSettings(**job.settings)
    dataset = job.identity["dataset"]
    register_champions(settings, results_of(job), dataset, job.input.runs, job.output.registry)


_job.run(register)
