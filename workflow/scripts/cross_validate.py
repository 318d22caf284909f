"""Train one model on every fold of the crops and score it on those left out."""

import adapter


def cross_validate(job: adapter.Job) -> None:
    from scenenet.contests.cross_validation import cross_validate
    from scenenet.detection import DetectionSettings
    from scenenet.protocol import ModelSettings

    model = job.identity["model"]
    cross_validate(
        job.input.manifests,
        None if model is None else ModelSettings(**model),
        job.identity["seeds"],
        job.settings["leave_out"],
        job.settings["neighbour"],
        DetectionSettings(**job.settings["detection"]),
        job.output.runs,
    )


adapter.run(cross_validate)
