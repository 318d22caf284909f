"""Train one model from one seed."""

from pathlib import Path

import _job


def train(job: _job.Job) -> None:
    from scenenet.core.files import write_json
    from scenenet.core.peak_memory import used
    from scenenet.dataset.voxels import VoxelSettings
    from scenenet.models.settings import ModelSettings
    from scenenet.training.train import train

    train(
        job.input.manifests,
        job.input.split,
        ModelSettings(**job.settings),
        job.identity["seed"],
        job.output.model,
        job.output.history,
        # Not an output of the rule, so that it survives a job that was stopped. The file itself
        # says which training it belongs to.
        checkpoint=Path(job.output.history).with_name("checkpoint.safetensors"),
        grid=VoxelSettings(**job.identity["grid"]),
        provenance=job.made_by(),
    )
    write_json(job.output.resources, used())


_job.run(train)
