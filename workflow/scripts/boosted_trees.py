"""Train and score the boosted trees, the baseline that SCENE-Net is compared with."""

import _job


def boosted_trees(job: _job.Job) -> None:
    from scenenet.baselines.evaluate import evaluate_boosted_trees
    from scenenet.detection.settings import DetectionSettings

    evaluate_boosted_trees(
        job.input.manifests,
        job.input.crops,
        job.input.split,
        DetectionSettings(**job.settings),
        job.identity["seeds"],
        job.output.scores,
        job.output.times,
    )


_job.run(boosted_trees)
