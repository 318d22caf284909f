"""Score one model, or all that is not trained, with and without rules, on points and voxels."""

import _job


def components(job: _job.Job) -> None:
    from scenenet.detection.settings import DetectionSettings
    from scenenet.experiments.components.run import Plan, score_model, score_untrained, write
    from scenenet.models.settings import ModelSettings

    settings, seeds = job.settings, job.identity["seeds"]
    plan = Plan(settings["leave_out"], settings["neighbour"], job.input.split)
    parts = plan.parts(job.input.manifests, job.input.crops)
    detection = DetectionSettings(**settings["detection"])
    model = job.identity["model"]
    model = None if model is None else ModelSettings(**model)
    if job.identity["trained"]:
        rows = score_model(parts, model, job.input.models, seeds, detection)
    else:
        rows = score_untrained(parts, model, seeds, detection)
    write(rows, job.output.runs, job.output.times)


_job.run(components)
