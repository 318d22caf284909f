"""Time a model on test crops."""

import _job


def inference_time(job: _job.Job) -> None:
    from scenenet.core.files import write_json
    from scenenet.evaluation.inference_time import time_model

    write_json(job.output.times, time_model(job.input.model, job.input.manifests, job.input.split))


_job.run(inference_time)
