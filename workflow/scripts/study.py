"""Run the trainings of one study."""

import _job


def study(job: _job.Job) -> None:
    from scenenet.dataset.split import SplitSettings
    from scenenet.dataset.voxels import VoxelSettings
    from scenenet.experiments.studies.run import run_study
    from scenenet.experiments.studies.settings import StudySettings
    from scenenet.models.settings import ModelSettings

    run_study(
        job.input.manifests,
        StudySettings(**job.settings),
        ModelSettings(**job.identity["model"]),
        VoxelSettings(**job.identity["voxels"]),
        SplitSettings(**job.identity["split"]),
        job.output.runs,
        job.output.times,
        job.identity["crops"],
    )


_job.run(study)
