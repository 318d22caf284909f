"""Write the lists, the status and the summary of a survey of tiles."""

import _job


def survey_lists(job: _job.Job) -> None:
    from pathlib import Path

    from scenenet.clearance.settings import ClearanceSettings
    from scenenet.detection.settings import DetectionSettings
    from scenenet.pointcloud.class_schemes import class_scheme
    from scenenet.prediction.jobs.write_lists import write_lists
    from scenenet.prediction.result_files import PredictionFiles
    from scenenet.prediction.settings import PredictSettings
    from scenenet.prediction.survey_files import SurveyFiles

    survey, codes = SurveyFiles.from_json(job.identity["survey"]), job.identity.get("codes")
    line = codes is not None
    tiles, observed = len(job.input.works), list(job.input.observed)
    of_observers = [observed[n : n + tiles] for n in range(0, len(observed), tiles)]
    write_lists(
        survey,
        job.input.works,
        [job.input.predictions, *of_observers],
        job.input.towers,
        job.input.written,
        [job.input.model, *job.input.observers],
        PredictionFiles.of(survey, Path(job.output.summary).parent, line=line),
        PredictSettings(**job.settings),
        DetectionSettings(**job.identity["detection"]),
        next(iter(job.input.line), None),
        next(iter(job.input.clearances), None),
        ClearanceSettings(**job.identity["clearance"]) if line else None,
        class_scheme(codes) if line else None,
    )


_job.run(survey_lists)
