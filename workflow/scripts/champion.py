"""Pick the seed of a model that is best on the validation part."""

import adapter


def champion(job: adapter.Job) -> None:
    from scenenet.training.tuning import champion

    champion(job.input.models, job.input.tunings, job.output.model)


adapter.run(champion)
