"""The result folder that tables, figures, MLflow and the report read."""

from __future__ import annotations

from pathlib import Path

import _job


def results_of(job: _job.Job):
    """The results that a job reads. They lie in the folder that it writes to: its record is
    RESULTS/STAGE/provenance.json, so a prefix of a module moves both."""
    from scenenet.experiments.studies.settings import StudySettings
    from scenenet.results.folder import Results

    given = job.identity["results"]
    return Results(
        **{
            **given,
            "folder": Path(job.output.provenance).parents[1],
            "models": dict(given["models"]),
            "studies": [StudySettings(**study) for study in given["studies"]],
        }
    )
