"""Make the MLflow store before anything logs to it."""

import adapter


def mlflow_store(job: adapter.Job) -> None:
    from scenenet.tracking import TrackingSettings, create_store
    from scenenet.tracking.study_runs import experiment_of

    settings = TrackingSettings(**job.settings)
    names = [experiment_of(settings, study).experiment for study in job.identity["studies"]]
    create_store(settings, job.output.store, names)


adapter.run(mlflow_store)
