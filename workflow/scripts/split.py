"""Split the crops into training, validation and test."""

import _job


def split(job: _job.Job) -> None:
    from scenenet.core.files import atomic
    from scenenet.dataset.split import SplitSettings, split_crops

    table = split_crops(job.input.manifests, SplitSettings(**job.settings))
    with atomic(job.output.split) as partial:
        table.to_csv(partial, index=False)


_job.run(split)
