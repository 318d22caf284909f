"""Bring every study into MLflow, each into an experiment of its own."""

import adapter


def track_studies(job: adapter.Job) -> None:
    from scenenet.results import read_table
    from scenenet.studies.settings import StudySettings
    from scenenet.tracking import TrackingSettings, log_runs
    from scenenet.tracking.studies import experiment_of, study_groups

    settings = TrackingSettings(**job.settings)
    studies = [StudySettings(**study) for study in job.identity["studies"]]
    for study, runs, record in zip(studies, job.input.runs, job.output.runs, strict=True):
        groups = study_groups(study, read_table(runs), job.identity["dataset"])
        log_runs(experiment_of(settings, study.name), groups, record, job.input.store)


adapter.run(track_studies)
