"""Make the MLflow store before anything logs to it."""

import adapter


def mlflow_store(job: adapter.Job) -> None:
    from scenenet.tracking import TrackingSettings, create_store

    create_store(TrackingSettings(**job.settings), job.output.store)


adapter.run(mlflow_store)
