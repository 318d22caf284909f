"""Choose the detection threshold of a trained model on the validation part."""

import _job


def tune(job: _job.Job) -> None:
    from scenenet.detection.settings import DetectionSettings
    from scenenet.evaluation.tune import tune
    from scenenet.models.settings import TuningSettings

    tune(
        job.input.model,
        job.input.manifests,
        job.input.crops,
        job.input.split,
        TuningSettings(**job.settings["tuning"]),
        DetectionSettings(**(job.settings["detection"] or {})),
        job.output.model,
        job.output.tuning,
    )


_job.run(tune)
