"""Crop a survey around each tower."""

import _job


def crops(job: _job.Job) -> None:
    from pathlib import Path

    import pandas as pd

    from scenenet.dataset.crops import CropSettings, Truth, cut_crops

    true_towers = pd.read_csv(job.input.true_towers, dtype={"sample": str})
    truth = [Truth(Path(path), true_towers) for path in job.input.truth]
    cut_crops(
        job.identity["survey"],
        job.input.survey,
        job.identity["codes"],
        pd.read_csv(job.input.towers, dtype={"sample": str}),
        CropSettings(**job.settings),
        job.output.store,
        job.output.manifest,
        truth[0] if truth else None,
    )


_job.run(crops)
