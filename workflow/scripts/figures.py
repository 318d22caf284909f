"""Draw those figures of the result folder that the job names."""

import adapter
from gathered import results_of


def figures(job: adapter.Job) -> None:
    from scenenet.experiments.published import read_thesis
    from scenenet.figures import draw_all, plan

    results = results_of(job)
    published = getattr(job.input, "thesis", None)
    thesis = read_thesis(published) if published else None
    wanted = set(job.identity["pictures"])
    planned = plan(results, thesis, job.identity["sources"])
    draw_all([d for d in planned if d.name in wanted], results.folder / "figures")


adapter.run(figures)
