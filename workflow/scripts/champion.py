"""Choose the seed of a model that is best on the validation part."""

import _job


def champion(job: _job.Job) -> None:
    from scenenet.training.champion import champion

    champion(job.input.models, job.input.tunings, job.output.model)


_job.run(champion)
