"""Split the squares of an observer into training, validation and test."""

import _job


def square_split(job: _job.Job) -> None:
    from scenenet.core.files import atomic
    from scenenet.dataset.split import SplitSettings, split_crops
    from scenenet.dataset.squares import require_squares

    require_squares(job.input.manifests, job.identity["observer"], job.identity["target"])
    table = split_crops(job.input.manifests, SplitSettings(**job.settings))
    with atomic(job.output.split) as partial:
        table.to_csv(partial, index=False)


_job.run(square_split)
