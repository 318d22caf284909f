"""Bring the best of each model and of all into MLflow's registry."""

import adapter
from gathered import results_of


def register(job: adapter.Job) -> None:
    from scenenet.tracking import TrackingSettings
    from scenenet.tracking.registry import register_champions

    settings = TrackingSettings(**job.settings)
    dataset = job.identity["dataset"]
    register_champions(settings, results_of(job), dataset, job.input.runs, job.output.registry)


adapter.run(register)
