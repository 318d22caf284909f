"""Log every study to MLflow, each as an MLflow experiment of its own."""

import _job


def track_studies(job: _job.Job) -> None:
    from pathlib import Path

    from scenenet.experiments.run_tables import with_times
    from scenenet.experiments.studies.settings import StudySettings
    from scenenet.figures import read_pictures
    from scenenet.results.result_files import read_result, read_table
    from scenenet.tracking.run_log import log_runs
    from scenenet.tracking.store import TrackingSettings, experiment_of
    from scenenet.tracking.study_runs import note_of, study_groups

    settings = TrackingSettings(**job.settings)
    studies = [StudySettings(**study) for study in job.identity["studies"]]
    made = (job.input.runs, job.input.times, job.input.records, job.input.pictures)
    files = zip(*made, job.output.runs, strict=True)
    for study, (runs, times, record, picture, logged) in zip(studies, files, strict=True):
        groups = study_groups(
            study,
            with_times(read_table(Path(runs)), read_table(Path(times))),
            job.identity["dataset"],
            job.identity["protocol"],
            read_result(Path(record)),
            read_pictures(Path(picture).parent, [Path(picture).stem]),
        )
        own = experiment_of(settings, study.name)
        log_runs(own, groups, logged, job.input.store, note_of(study))


_job.run(track_studies)
