"""Run the trainings of one study."""

import adapter


def study(job: adapter.Job) -> None:
    from scenenet.protocol import ModelSettings
    from scenenet.split import SplitSettings
    from scenenet.studies.run import run_study
    from scenenet.studies.settings import StudySettings
    from scenenet.voxels import VoxelSettings

    run_study(
        job.input.manifests,
        StudySettings(**job.settings),
        ModelSettings(**job.identity["model"]),
        VoxelSettings(**job.identity["voxels"]),
        SplitSettings(**job.identity["split"]),
        job.output.runs,
    )


adapter.run(study)
