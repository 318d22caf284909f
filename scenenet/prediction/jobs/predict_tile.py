"""Predicts a file of a survey with its neighbours."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from scenenet.core.errors import InputError
from scenenet.measurement.registry import measurement_named
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.work.lattice import Lattice
from scenenet.prediction.work.survey_work import belonging
from scenenet.prediction.work.tile_predictor import (
    needed_around,
    observed_voxel_size,
    predict_file,
)
from scenenet.prediction.work.tiling import Layer, TileSpool
from scenenet.prediction.work.work_file import WorkFile


def model_voxel_size(model: str | Path, settings: PredictSettings) -> float:
    """m, edge of the voxels in which a model observes surveys.

    Raises:
        InputError: the model cannot be used.
    """
    from scenenet.models.model_file import read_model

    trained, card = read_model(model)
    card.threshold()  # fail before the work: without tau there is no tower
    return observed_voxel_size(trained, card, settings)


def further_voxel_sizes(
    observers: Sequence[tuple[float, float | None]], size: float, settings: PredictSettings
) -> list[float]:
    """m, edges of further voxels in which observers observe surveys, known before they are trained.

    Args:
        observers: of each the voxel size of its crops, and the edge of the blocks that it observes
            (``MetricSettings.observed``), both in m; None for kernels in voxels.
        size: m, edge of the voxels of the model of towers.
        settings: of the prediction.
    """
    from scenenet.convolution.coarsening import block_edge

    found = []
    for trained, observed in observers:
        fine = settings.voxel_size or trained
        found.append(fine if observed is None else fine * block_edge(fine, observed))
    return [each for each in dict.fromkeys(found) if each != size]


def predict_tile(
    work: str | Path,
    neighbours: Sequence[str | Path],
    model: str | Path,
    out: str | Path,
    within: float,
    fullest: int | None,
    settings: PredictSettings,
) -> None:
    """Predict a file of a survey, with its neighbours as surroundings.

    Args:
        work: its work file.
        neighbours: the work files of all files within a distance of it.
        model: model file.
        out: file of predictions to write.
        within: that distance, m.
        fullest: points in the fullest voxel of the survey (``fullest_in``), for a model that
            measures density; None for others.
        settings: of the prediction.

    Raises:
        InputError: the distance is too small for the voxels of the model, or the model cannot be
            used.
    """
    from scenenet.models.model_file import read_model

    trained, card = read_model(model)
    own = WorkFile.open(work)
    size = observed_voxel_size(trained, card, settings)
    needed = needed_around(trained, card, size)
    if needed > within:
        raise InputError(
            f"voxels of {size:g} m need the tiles within {needed:.0f} m, and the "
            f"workflow takes those within {within:g} m for neighbours",
            file=model,
            remedy="Set predict.voxel_size to a smaller value, or predict the survey with "
            "scenenet predict",
        )
    measurement = measurement_named(card.measurement)
    if "fullest" in measurement.needs and fullest is None:
        raise InputError(
            f"the model measures {card.measurement}, which its training settings do not say",
            file=model,
        )
    if measurement.fields:
        raise InputError(
            f"the model measures {card.measurement}, and the workflow does not read "
            f"{' and '.join(measurement.fields)}",
            file=model,
            remedy="Predict the survey with scenenet predict",
        )
    near = [own, *map(WorkFile.open, neighbours)]
    same = [] if own.system is None else list(belonging(near, own.system))
    layer = None if size == own.lattice.voxel_size else Layer(size)
    if layer is not None and layer.kind not in own.blocks.kinds:
        raise InputError(
            f"the model observes voxels of {size:g} m, and the tiles were read without them, for "
            "models of other voxel sizes",
            file=model,
            remedy="Train the model with the settings of this workflow, or predict the survey with "
            "scenenet predict",
        )
    spool = TileSpool(Lattice(size), (each.blocks for each in same), layer)
    predict_file(own, spool, out, trained, card, fullest or 1)
