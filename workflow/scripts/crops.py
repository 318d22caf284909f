"""Cut the surroundings of each tower out of a survey."""

import adapter


def crops(job: adapter.Job) -> None:
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


adapter.run(crops)
