"""Classify a survey, list its towers and measure its lines."""

from pathlib import Path

import _job


def predict(job: _job.Job) -> None:
    from scenenet.clearance.settings import ClearanceSettings
    from scenenet.detection.settings import DetectionSettings
    from scenenet.pointcloud.class_schemes import class_scheme
    from scenenet.pointcloud.las.crs import named_system
    from scenenet.pointcloud.reading import survey_of_lengths
    from scenenet.prediction.result_files import PredictionFiles, require_space
    from scenenet.prediction.settings import PredictSettings
    from scenenet.prediction.survey_files import SurveyFiles
    from scenenet.prediction.writers import predict_to_files
    from scenenet.review.rejected_conductors import RejectedConductors

    survey, output = Path(job.input.survey), job.output
    given, codes = job.identity.get("crs"), job.identity.get("codes")
    crs = None if given is None else named_system(given)
    models = [job.input.model, *job.input.observers]
    lists = (Path(output[name]) for name in ("geopackage", "geojson", "table", "summary", "page"))
    tables = None
    if codes is not None:
        tables = Path(output.spans), Path(output.conductors), Path(output.clearances)
    files = PredictionFiles({survey: Path(output.points)}, *lists, line_tables=tables)
    points = survey_of_lengths(survey, crs).n_points
    require_space([(files, {survey: points})], len(models))
    predict_to_files(
        SurveyFiles.of(survey, crs),
        models,
        files,
        PredictSettings(**job.settings),
        DetectionSettings(**job.identity["detection"]),
        scheme=None if codes is None else class_scheme(codes),
        clearance=None if codes is None else ClearanceSettings(**job.identity["clearance"]),
        rejects=RejectedConductors.of(job.input.decisions),
    )


_job.run(predict)
