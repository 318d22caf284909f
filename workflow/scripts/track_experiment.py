"""Log an experiment to MLflow, as an MLflow experiment of its own."""

import _job


def track_experiment(job: _job.Job) -> None:
    from pathlib import Path

    from scenenet.experiments.run_tables import with_times
    from scenenet.figures import read_pictures
    from scenenet.results.result_files import read_result, read_table
    from scenenet.tracking.experiment_runs import EXPERIMENT_GROUPS, experiment_note, origin_of
    from scenenet.tracking.run_log import log_runs
    from scenenet.tracking.store import TrackingSettings, experiment_of

    experiment = job.identity["experiment"]
    settings = experiment_of(TrackingSettings(**job.settings), experiment)
    # The jobs of an experiment have the same settings and code, so the record of one is enough.
    records = [read_result(Path(path)) for path in (job.input.joined, job.input.record)]
    pictures = read_pictures(Path(job.input.pictures).parent, [experiment])
    origin = origin_of(job.identity["dataset"], *records, pictures)
    runs = with_times(read_table(Path(job.input.runs)), read_table(Path(job.input.times)))
    groups = EXPERIMENT_GROUPS[experiment](runs, origin)
    log_runs(settings, groups, job.output.runs, job.input.store, experiment_note(experiment))


_job.run(track_experiment)
