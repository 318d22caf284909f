"""Draw the figures of the result folder that the job names."""

import _job
from _results import results_of


def figures(job: _job.Job) -> None:
    from scenenet.experiments.published import read_thesis
    from scenenet.figures import draw_all, plan

    results = results_of(job)
    published = getattr(job.input, "thesis", None)
    thesis = read_thesis(published) if published else None
    sources = {}
    if "source" in job.identity:
        survey, codes = job.identity["source"]
        sources = {survey: (job.input.survey, codes)}
    wanted = set(job.identity["pictures"])
    planned = plan(results, thesis, sources)
    draw_all([d for d in planned if d.name in wanted], results.folder / "figures")


_job.run(figures)
