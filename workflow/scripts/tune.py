"""Choose the detection threshold of a trained model on the validation part."""

import _job


def tune(job: _job.Job) -> None:
    from scenenet.models.settings import TuningSettings
    from scenenet.training.tuning import tune

    tune(
        job.input.model,
        job.input.manifests,
        job.input.split,
        TuningSettings(**job.settings),
        job.output.model,
        job.output.tuning,
    )


_job.run(tune)
