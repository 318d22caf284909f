"""Train all models on labels of which a known share is wrong."""

import _job


def label_noise(job: _job.Job) -> None:
    from scenenet.dataset.voxels import VoxelSettings
    from scenenet.experiments.label_noise.run import train_with_label_noise
    from scenenet.experiments.label_noise.settings import LabelNoiseSettings
    from scenenet.models.settings import ModelSettings

    train_with_label_noise(
        LabelNoiseSettings(**job.settings),
        [ModelSettings(**model) for model in job.identity["models"]],
        VoxelSettings(**job.identity["voxels"]),
        job.identity["seed"],
        job.output.runs,
        job.output.times,
    )


_job.run(label_noise)
