"""Make one test crop ready for the page's 3D view."""

import adapter
from gathered import results_of


def scene(job: adapter.Job) -> None:
    from scenenet.detection.settings import DetectionSettings
    from scenenet.figures.interactive_crop import write_scene

    write_scene(
        results_of(job),
        job.identity["model"],
        job.identity["rank"],
        job.output.scene,
        DetectionSettings(**job.settings),
    )


adapter.run(scene)
