"""Crop a survey around each tower."""

import _job


def crops(job: _job.Job) -> None:
    import pandas as pd

    from scenenet.dataset.crops import CropSettings, cut_crops

    cut_crops(
        job.identity["survey"],
        job.input.survey,
        job.identity["codes"],
        pd.read_csv(job.input.towers, dtype={"sample": str}),
        CropSettings(**job.settings),
        job.output.store,
        job.output.manifest,
    )


_job.run(crops)
