"""The result folder that tables, figures, MLflow and report read."""

from __future__ import annotations

import adapter


def results_of(job: adapter.Job):
    from scenenet.experiments.studies.settings import StudySettings
    from scenenet.results.folder import Results

    asked = job.identity["results"]
    studies = [StudySettings(**study) for study in asked["studies"]]
    return Results(**{**asked, "models": dict(asked["models"]), "studies": studies})
