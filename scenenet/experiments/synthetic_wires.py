"""Points of wires that models find in a synthetic survey, beside those that are wires in truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scenenet.detection.settings import DetectionSettings
from scenenet.metrics.voxel_scores import Confusion
from scenenet.models.model_file import read_model
from scenenet.models.packaged import packaged_model
from scenenet.pointcloud.reading import read
from scenenet.prediction.predict import predict_survey
from scenenet.prediction.settings import PredictSettings
from scenenet.synthetic.codes import CONDUCTOR
from scenenet.synthetic.settings import SyntheticSettings
from scenenet.synthetic.survey import make_survey


@dataclass(frozen=True)
class FoundWires:
    """The points of a survey.

    Attributes:
        xyz: (N, 3) m, positions.
        true: (N,) bool, which are wires in truth.
        taken: (N,) bool for each model, which it takes for wires; with the line, for each model
            twice, without it and with it.
    """

    xyz: np.ndarray
    true: np.ndarray
    taken: tuple[np.ndarray, ...]


def look(
    settings: SyntheticSettings, models: Sequence[Path], folder: Path, *, line: bool = False
) -> FoundWires:
    """Make a survey, and find its wires with each model: points in voxels that reach its tau. The
    files of the survey are deleted afterwards.

    Args:
        folder: for these files.
        line: whether towers and lines are looked for too, with the model of towers of the package,
            as ``scenenet predict --line`` does. Without, no rule for towers takes part.

    Raises:
        InputError: a model cannot be used.
    """
    survey, true = folder / f"{settings.seed}.laz", folder / f"{settings.seed}.truth.laz"
    make_survey(settings, survey, true, progress=f"seed {settings.seed}: survey made")
    truth = read(true)
    taken = []
    for model in models:
        _, card = read_model(model)
        used = [packaged_model(), model] if line else model
        with predict_survey(survey, used, PredictSettings(), DetectionSettings()) as predicted:
            number = predicted.target_names.index(card.finds.name)
            points = predicted.look_up(truth.xyz)
            taken.append(points.models[number].probability >= card.threshold())
            if line:
                taken.append(predicted.points.taken(points, number))
    for path in (survey, true):
        path.unlink()
    return FoundWires(truth.xyz, truth.classification == CONDUCTOR, tuple(taken))


def every_point(counts: Confusion) -> Confusion:
    """The trivial answer for the same points: each of them is a wire."""
    return Confusion(tp=counts.tp + counts.fn, fp=counts.fp + counts.tn)


def two_digits(score: float | None) -> str:
    """A score in a table."""
    return "-" if score is None else f"{score:.2f}"
