"""Score a tuned model on the test part."""

import adapter


def evaluate(job: adapter.Job) -> None:
    from scenenet.detection import DetectionSettings
    from scenenet.evaluation import evaluate
    from scenenet.files import write_json

    scores = evaluate(
        job.input.model,
        job.input.manifests,
        job.input.split,
        DetectionSettings(**job.settings),
        part=job.identity["part"],
    )
    write_json(job.output.scores, scores)


adapter.run(evaluate)
