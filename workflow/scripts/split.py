"""Share the crops out to training, validation and test."""

import adapter


def split(job: adapter.Job) -> None:
    from scenenet.core.files import atomic
    from scenenet.dataset.split import SplitSettings, split_crops

    table = split_crops(job.input.manifests, SplitSettings(**job.settings))
    with atomic(job.output.split) as partial:
        table.to_csv(partial, index=False)


adapter.run(split)
