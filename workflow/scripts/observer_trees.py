"""Train and score the boosted trees beside an observer, the baseline that it is compared with."""

import _job


def observer_trees(job: _job.Job) -> None:
    from scenenet.baselines.evaluate import evaluate_trees_of_observer
    from scenenet.pointcloud.targets import Target

    evaluate_trees_of_observer(
        job.identity["observer"],
        Target.parse(job.identity["target"]),
        job.settings["false_weight"],
        job.input.manifests,
        job.input.crops,
        job.input.split,
        job.identity["seed"],
        job.output.scores,
    )


_job.run(observer_trees)
