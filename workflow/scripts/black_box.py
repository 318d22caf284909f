"""Train and score the black box that SCENE-Net is measured against."""

import adapter


def black_box(job: adapter.Job) -> None:
    from scenenet.detection import DetectionSettings
    from scenenet.evaluation import evaluate_black_box

    evaluate_black_box(
        job.input.manifests,
        job.input.split,
        DetectionSettings(**job.settings),
        job.identity["seeds"],
        job.output.scores,
        job.output.times,
    )


adapter.run(black_box)
