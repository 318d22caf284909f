"""Bring a contest into MLflow, into an experiment of its own."""

import adapter


def track_contest(job: adapter.Job) -> None:
    from scenenet.results import read_table
    from scenenet.tracking import TrackingSettings, log_runs
    from scenenet.tracking.contests import CONTEST_GROUPS
    from scenenet.tracking.studies import experiment_of

    contest = job.identity["contest"]
    settings = experiment_of(TrackingSettings(**job.settings), contest)
    groups = CONTEST_GROUPS[contest](read_table(job.input.runs), job.identity["dataset"])
    log_runs(settings, groups, job.output.runs, job.input.store)


adapter.run(track_contest)
