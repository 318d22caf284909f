"""Copy the model that predicts, and write its card."""

import _job
import _results


def packaged_model(job: _job.Job) -> None:
    from scenenet.results.model_card import write_model_card

    write_model_card(_results.results_of(job), job.input.model, job.output.model, job.output.card)


_job.run(packaged_model)
