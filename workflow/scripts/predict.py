"""Classify a survey and list its towers."""

from pathlib import Path

import _job


def predict(job: _job.Job) -> None:
    from scenenet.detection.settings import DetectionSettings
    from scenenet.pointcloud.las.crs import named_system
    from scenenet.pointcloud.reading import survey_of_lengths
    from scenenet.prediction.result_files import PredictionFiles, require_space
    from scenenet.prediction.settings import PredictSettings
    from scenenet.prediction.survey_files import SurveyFiles
    from scenenet.prediction.writers import predict_to_files

    survey, output = Path(job.input.survey), job.output
    given = job.identity.get("crs")
    crs = None if given is None else named_system(given)
    lists = (Path(output[name]) for name in ("geopackage", "geojson", "table", "summary", "page"))
    files = PredictionFiles({survey: Path(output.points)}, *lists)
    require_space([(files, {survey: survey_of_lengths(survey, crs).n_points})])
    predict_to_files(
        SurveyFiles.of(survey, crs),
        job.input.model,
        files,
        PredictSettings(**job.settings),
        DetectionSettings(**job.identity["detection"]),
    )


_job.run(predict)
