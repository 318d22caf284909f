"""Log every training to MLflow."""

import _job
from _results import results_of

NOTE = (
    "Every training: a run for each model with the mean and spread over its seeds, and nested in "
    "it a run for each seed. The boosted trees on features of the voxels are the baseline."
)


def track(job: _job.Job) -> None:
    from scenenet.figures import read_pictures
    from scenenet.tracking.model_runs import model_groups
    from scenenet.tracking.run_log import log_runs
    from scenenet.tracking.store import TrackingSettings

    results = results_of(job)
    groups = model_groups(
        results,
        job.identity["dataset"],
        settings=job.identity["common_settings"],
        protocol=job.identity["protocol"],
        pictures=read_pictures(results.folder / "figures", job.identity["pictures"]),
    )
    settings = TrackingSettings(**job.settings)
    log_runs(settings, groups, job.output.runs, job.input.store, NOTE)


_job.run(track)
