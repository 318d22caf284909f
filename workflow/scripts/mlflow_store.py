"""Create the MLflow store before any job logs to it."""

import _job


def mlflow_store(job: _job.Job) -> None:
    from scenenet.tracking.store import TrackingSettings, create_store, experiment_of

    settings = TrackingSettings(**job.settings)
    names = [experiment_of(settings, study).experiment for study in job.identity["studies"]]
    create_store(settings, job.output.store, names, job.identity["request"])


_job.run(mlflow_store)
