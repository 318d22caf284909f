"""Score a tuned model on the test part."""

import _job


def evaluate(job: _job.Job) -> None:
    from scenenet.core.files import write_json
    from scenenet.detection.settings import DetectionSettings
    from scenenet.evaluation.scoring import evaluate

    scores = evaluate(
        job.input.model,
        job.input.manifests,
        job.input.crops,
        job.input.split,
        DetectionSettings(**job.settings),
        part=job.identity["part"],
    )
    write_json(job.output.scores, scores.to_json())


_job.run(evaluate)
