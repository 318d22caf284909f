"""Train one model on every fold of the crops and score it on the crops left out."""

import _job


def cross_validation(job: _job.Job) -> None:
    from scenenet.detection.settings import DetectionSettings
    from scenenet.experiments.cross_validation.run import cross_validate
    from scenenet.models.settings import ModelSettings

    model = job.identity["model"]
    cross_validate(
        job.input.manifests,
        job.input.crops,
        None if model is None else ModelSettings(**model),
        job.identity["seeds"],
        job.settings["leave_out"],
        job.settings["neighbour"],
        DetectionSettings(**job.settings["detection"]),
        job.output.runs,
        job.output.times,
    )


_job.run(cross_validation)
