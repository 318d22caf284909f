"""The result folder that tables, figures, MLflow and report read."""

from __future__ import annotations

import adapter


def results_of(job: adapter.Job):
    from scenenet.results import Results

    asked = job.identity["results"]
    return Results(**{**asked, "models": dict(asked["models"])})
