"""Bring a contest into MLflow, into an experiment of its own."""

import adapter


def track_contest(job: adapter.Job) -> None:
    from pathlib import Path

    from scenenet.figures import read_pictures
    from scenenet.results.folder import read_result, read_table
    from scenenet.tracking import TrackingSettings, log_runs
    from scenenet.tracking.experiment_runs import CONTEST_GROUPS, CONTEST_NOTES, origin_of
    from scenenet.tracking.study_runs import experiment_of

    contest = job.identity["contest"]
    settings = experiment_of(TrackingSettings(**job.settings), contest)
    records = [read_result(Path(path)) for path in (job.input.gathered, job.input.record)]
    pictures = read_pictures(Path(job.input.pictures).parent, [contest])
    origin = origin_of(job.identity["dataset"], *records, pictures)
    groups = CONTEST_GROUPS[contest](read_table(job.input.runs), origin)
    log_runs(settings, groups, job.output.runs, job.input.store, CONTEST_NOTES[contest])


adapter.run(track_contest)
