"""Scoring a model with labelled files, without the workflow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import typer

from scenenet.cli.inputs import Failures
from scenenet.cli.labelled_files import read_labelled, require_crops
from scenenet.core.errors import InputError
from scenenet.core.scratch import scratch_folder
from scenenet.dataset.voxels import VoxelSettings
from scenenet.detection.settings import DetectionSettings
from scenenet.evaluation.result import Evaluation, PointScores, TowerScores
from scenenet.evaluation.scoring import score
from scenenet.evaluation.surveys import SurveyScores, score_survey
from scenenet.models.model_file import ModelCard, read_model
from scenenet.models.packaged import packaged_model
from scenenet.pointcloud.targets import WIRE, Target
from scenenet.prediction.used_models import ModelPaths


def evaluate_files(
    paths: Sequence[Path],
    model: str | Path,
    codes: str,
    grid: VoxelSettings | None,
    detection: DetectionSettings,
    failures: Failures,
    truths: Sequence[Path] = (),
    target: Target | None = None,
    *,
    line: bool = False,
) -> dict[str, Any]:
    """Scores of a model on labelled files, against their labels and against the truth.

    Points are scored by the prediction that ``scenenet predict`` makes for each file, whatever the
    grid. Towers are scored for a model that finds towers.

    Args:
        grid: the grid for the voxel scores; None for the model's own voxel size. With None, towers
            are detected in whole surveys instead of crops around the labelled towers, so that
            false towers everywhere count, also in surveys without towers.
        truths: as in ``read_labelled``.
        target: what is scored, if its class codes are other ones in these files than in those that
            the model was trained on; None for the target of the model.
        line: whether towers and lines are looked for too, with the model of towers of the package;
            points of conductors then count as wires.

    Returns:
        the evaluation as plain values, with ``skipped`` and ``warnings``.

    Raises:
        InputError: the model cannot be used, it does not find ``target``, or no file has a crop or
            survey to score.
        typer.Exit: no file could be read.
        typer.BadParameter: ``line`` for a model that finds no wires.
    """
    trained, card = read_model(model)
    target = _scored(card, codes, target, model)
    if line and target.name != WIRE:
        raise typer.BadParameter(
            f"needs a model of {WIRE}; {model} finds {target.name}", param_hint="--line"
        )
    models: ModelPaths = [packaged_model(), model] if line else model
    whole_surveys = grid is None
    grid = grid or VoxelSettings(fit="metric", voxel_size=card.voxel_size)
    with scratch_folder() as scratch:
        files = read_labelled(
            paths,
            codes,
            grid,
            failures,
            scratch,
            truths=truths,
            target=target,
            measurement=card.measurement,
        )
    if not (whole_surveys and files.surveys):
        require_crops(files, paths, failures, target, codes)
    found = SurveyScores()
    grids = {sample.id: sample.grid for sample in files.dataset.samples}
    for survey in files.surveys:
        with failures.collect():
            found += score_survey(survey, models, detection, grids)
    scored = files.dataset.only(found.by_crop)
    result = score(trained, card, scored, lambda sample: found.by_crop[sample.id])
    result = _of_whole_files(result, found, towers=whole_surveys)
    result = replace(result, target=target.text)
    return result.to_json() | {"skipped": files.skipped, "warnings": files.warnings}


def _scored(card: ModelCard, codes: str, target: Target | None, model: str | Path) -> Target:
    """What is scored in files of the class scheme ``codes``; arguments as ``evaluate_files``.

    Raises:
        InputError: the model finds something else, or its target has codes of another scheme.
    """
    own = card.finds
    if target is None:
        if own.own_codes is None or card.codes == codes:
            return own
        raise InputError(
            f"it finds {own.text} in class scheme {card.codes}, and the scheme of the labels is "
            f"{codes}",
            file=model,
            remedy=f"Give the codes in {codes}: --target {own.name}=CODES",
        )
    if target.name != own.name:
        raise InputError(
            f"it finds {own.name}, not {target.name}",
            file=model,
            remedy="Leave out --target, or name another model",
        )
    return target


def _of_whole_files(result: Evaluation, found: SurveyScores, *, towers: bool) -> Evaluation:
    """The scores of crops with the points of whole files instead, and with their towers if asked.

    Without a crop there is nothing to count in voxels, neither for the labels nor for the truth.
    """
    true = found.points.truth
    truth = None if true is None else result.truth or result.labels
    if truth is not None and true is not None:
        truth = replace(truth, points=PointScores.of(true))
        if towers and found.true_towers is not None:
            truth = replace(truth, towers=TowerScores.of(found.true_towers))
    of_labels = found.points.labels_against_truth
    return replace(
        result,
        points=PointScores.of(found.points.labels),
        towers=TowerScores.of(found.towers) if towers else result.towers,
        truth=truth,
        labels_against_truth=None if of_labels is None else PointScores.of(of_labels),
    )
