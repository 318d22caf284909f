"""Training with labelled files, without the workflow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from scenenet.cli.inputs import Failures
from scenenet.cli.labelled_files import LabelledFiles, read_labelled, require_crops
from scenenet.core.scratch import scratch_folder
from scenenet.dataset.split import SplitSettings
from scenenet.dataset.square_settings import SquareSettings
from scenenet.dataset.voxels import VoxelSettings
from scenenet.detection.settings import DetectionSettings
from scenenet.evaluation.tune import with_answer
from scenenet.interpretability.determination import determination
from scenenet.interpretability.parameter_sentences import parameters_of
from scenenet.metrics.voxel_scores import VoxelScores
from scenenet.models.base import VoxelModel
from scenenet.models.geneo_model import GeneoModel
from scenenet.models.model_file import ModelCard, write_model
from scenenet.models.settings import ModelSettings, TuningSettings
from scenenet.training.train import card_of, fit
from scenenet.training.tuning import choose
from scenenet.training.tuning_result import Tuning


def train_files(
    paths: Sequence[Path],
    codes: str,
    grid: VoxelSettings,
    settings: ModelSettings,
    tuning: TuningSettings,
    seeds: Sequence[int],
    validation: float,
    detection: DetectionSettings,
    provenance: dict[str, Any],
    out: str | Path,
    failures: Failures,
    squares: SquareSettings | None = None,
) -> dict[str, Any]:
    """Train with several seeds, tune each model on the validation crops, and write the best one.

    Args:
        validation: share of the crops for tuning. With 0 or a single crop, models are tuned on the
            training crops. The scores are then too high, and ``tuned_on`` is ``training``.
        detection: what makes a tower; the model whose towers are best is chosen.
        squares: size of a crop for another target than towers; the default if None.

    Returns:
        the scores of each seed, the chosen seed, the parameters of the chosen model and whether
        the crops determine them, the numbers of crops, the skipped files, and what looks wrong
        about the files.

    Raises:
        InputError: no file has a point labelled with the target of the model.
        typer.Exit: no file could be read.
    """
    split = SplitSettings(train=1 - validation, validation=validation, test=0, neighbour=0)
    with scratch_folder() as scratch:
        files = read_labelled(
            paths,
            codes,
            grid,
            failures,
            scratch,
            split if validation > 0 else None,
            target=settings.finds,
            squares=squares,
            measurement=settings.measurement,
        )
        require_crops(files, paths, failures, settings.finds, codes)
        made_by = provenance | {"files": [path.name for path in files.read]}
        found = [
            _candidate(files, grid, settings, tuning, seed, detection, made_by) for seed in seeds
        ]
    best = max(found, key=lambda candidate: candidate.tuning.decisive)
    write_model(out, best.model, best.card)
    return {"model": str(out), "target": settings.finds.name} | _summary(files, found, best)


@dataclass(frozen=True)
class _Candidate:
    """A trained and tuned model."""

    seed: int
    model: VoxelModel
    card: ModelCard
    tuning: Tuning


def _candidate(
    files: LabelledFiles,
    grid: VoxelSettings,
    settings: ModelSettings,
    tuning: TuningSettings,
    seed: int,
    detection: DetectionSettings,
    provenance: dict[str, Any],
) -> _Candidate:
    """Train and tune the model of one seed."""
    training, kept = files.training, files.validation
    tuned_on, others = (kept, training) if kept else (training, [])
    model, _ = fit(training, kept, settings, seed)
    card = card_of(replace(files.dataset, samples=training), settings, grid, seed, provenance)
    tuned, card, result = choose(model, card, tuned_on, tuning, others)
    result = with_answer(result, tuned, card, tuned_on, files.clouds, detection)
    return _Candidate(seed, tuned, card, result)


def _summary(files: LabelledFiles, found: Sequence[_Candidate], best: _Candidate) -> dict[str, Any]:
    """What ``train_files`` returns about the trainings."""
    tuning = best.tuning
    return {
        "seed": best.seed,
        "tau": tuning.tau,
        "kernel_size": list(tuning.kernel_size),
        "tuned_on": "validation" if files.validation else "training",
        "scores": asdict(tuning.validation),
        "whole_towers": _plain(tuning.whole_towers),
        "seeds": [_of_seed(candidate.seed, candidate.tuning) for candidate in found],
        "numbers": _numbers(best.model, [candidate.model for candidate in found]),
        "crops": {"training": len(files.training), "validation": len(files.validation)},
        "skipped": files.skipped,
        "warnings": files.warnings,
    }


def _of_seed(seed: int, found: Tuning) -> dict[str, Any]:
    """What the tuning found for one seed."""
    return {
        "seed": seed,
        "kernel_size": list(found.kernel_size),
        **asdict(found.validation),
        "whole_towers": _plain(found.whole_towers),
    }


def _plain(scores: VoxelScores | None) -> dict[str, Any] | None:
    return None if scores is None else asdict(scores)


def _numbers(chosen: VoxelModel, models: Sequence[VoxelModel]) -> list[dict[str, Any]]:
    """The parameters of the chosen model, with what the models of all seeds say about each; none
    for models in voxels."""
    said = determination([model for model in models if isinstance(model, GeneoModel)])
    if not said or not isinstance(chosen, GeneoModel):
        return []
    values = chosen.shape_parameters()
    return [
        {"name": p.name, "value": values[p.name], "unit": p.unit, **said[p.name]._asdict()}
        for p in parameters_of(chosen, chosen.voxel_size or 1.0)
        if p.name in said
    ]
