"""Train SCENE-Net and its rivals on labels of which a known share is wrong."""

import adapter


def noise(job: adapter.Job) -> None:
    from scenenet.contests.noise import run_noise
    from scenenet.contests.settings import NoiseSettings
    from scenenet.protocol import ModelSettings
    from scenenet.voxels import VoxelSettings

    run_noise(
        NoiseSettings(**job.settings),
        [ModelSettings(**model) for model in job.identity["models"]],
        VoxelSettings(**job.identity["voxels"]),
        job.identity["seed"],
        job.output.runs,
    )


adapter.run(noise)
