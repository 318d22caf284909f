"""Cut a survey into squares that hold the target of an observer."""

import _job


def squares(job: _job.Job) -> None:
    from pathlib import Path

    from scenenet.dataset.square_settings import SquareSettings
    from scenenet.dataset.squares import cut_squares
    from scenenet.pointcloud.targets import Target

    truth = [Path(path) for path in job.input.truth]
    cut_squares(
        job.identity["survey"],
        job.input.survey,
        job.identity["codes"],
        Target.parse(job.identity["target"]),
        SquareSettings(**job.settings),
        job.output.store,
        job.output.manifest,
        truth[0] if truth else None,
    )


_job.run(squares)
