"""Bring every training into MLflow."""

import adapter
from gathered import results_of


def track(job: adapter.Job) -> None:
    from scenenet.figures import read_pictures
    from scenenet.tracking import TrackingSettings, log_runs, model_groups

    results = results_of(job)
    groups = model_groups(
        results,
        job.identity["dataset"],
        settings=job.identity["common_settings"],
        protocol=job.identity["protocol"],
        pictures=read_pictures(results.folder / "figures", job.identity["pictures"]),
    )
    log_runs(TrackingSettings(**job.settings), groups, job.output.runs, job.input.store)


adapter.run(track)
