"""Train and score the black box that SCENE-Net is measured against."""

import adapter


def black_box(job: adapter.Job) -> None:
    from scenenet.baselines.evaluate import evaluate_boosted_trees
    from scenenet.detection.settings import DetectionSettings

    evaluate_boosted_trees(
        job.input.manifests,
        job.input.split,
        DetectionSettings(**job.settings),
        job.identity["seeds"],
        job.output.scores,
        job.output.times,
    )


adapter.run(black_box)
