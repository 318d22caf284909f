"""Training of one model with one seed, by its protocol (thesis 5.2.1)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from scenenet.core.errors import InputError
from scenenet.core.files import atomic, digest
from scenenet.dataset.split import crops_in
from scenenet.dataset.voxel_cache import Dataset, load
from scenenet.dataset.voxels import VoxelSample, VoxelSettings, median_voxel_size
from scenenet.models.base import VoxelModel
from scenenet.models.model_file import ModelCard, write_model
from scenenet.models.settings import ModelSettings
from scenenet.training.checkpoint import Checkpoint, identity_of
from scenenet.training.gradient import fit_by_gradient
from scenenet.training.metric_search import fit_by_search


def train(
    voxel_manifests: Sequence[str | Path],
    split: str | Path,
    model: ModelSettings,
    seed: int,
    out_model: str | Path,
    out_history: str | Path,
    checkpoint: str | Path,
    grid: VoxelSettings,
    provenance: Mapping[str, Any],
) -> None:
    """Train one model with one seed on the training part, and write it with its history.

    Args:
        voxel_manifests: of the voxel stores, all of the same grid.
        split: CSV file of ``scenenet.dataset.split``.
        out_history: CSV file with a row per epoch: epoch, loss, fidelity, penalty,
            validation_loss, validation_f05, seconds, and for SCENE-Net a column per parameter.
        checkpoint: file from which an interrupted training continues; removed at the end.
        provenance: written to the model file beside seed and data fingerprint.
    """
    training = load(voxel_manifests, crops_in(split, "train"))
    if training.target != model.finds:
        raise InputError(
            f"the crops are labelled for target {training.target.text}, and the model "
            f"{model.name!r} finds {model.target}",
            remedy="Train it with scenenet train, which cuts its own crops",
        )
    validation = load(voxel_manifests, crops_in(split, "validation"))
    trained, history = fit(
        training.samples, validation.samples, model, seed, checkpoint=Path(checkpoint)
    )
    card = card_of(training, model, grid, seed, provenance)
    with atomic(out_history) as partial:
        history.to_csv(partial, index=False)
    write_model(out_model, trained, card)
    Path(checkpoint).unlink(missing_ok=True)


def card_of(
    training: Dataset,
    model: ModelSettings,
    grid: VoxelSettings,
    seed: int,
    provenance: Mapping[str, Any],
) -> ModelCard:
    """The card of a model trained on ``training``."""
    return ModelCard(
        name=model.name,
        codes=training.codes,
        target=model.target,
        measurement=model.measurement,
        fit=grid.fit,
        resolution=grid.resolution,
        voxel_size=median_voxel_size(training.samples),
        provenance={
            "seed": seed,
            "data": digest(sorted(training.content)),
            "training_crops": len(training.samples),
            **_how_trained(model),
            **provenance,
        },
    )


def _how_trained(model: ModelSettings) -> dict[str, Any]:
    settings = model.model_dump(mode="json")
    keys = [key for key in ("protocol", "training", "search") if key in settings]
    found: dict[str, Any] = {key: settings[key] for key in keys}
    if "kernel_size" in settings:
        found["trained_kernel_size"] = settings["kernel_size"]
    return found


def fit(
    training: Sequence[VoxelSample],
    validation: Sequence[VoxelSample],
    settings: ModelSettings,
    seed: int,
    *,
    checkpoint: Path | None = None,
    with_evidence: bool = True,
) -> tuple[VoxelModel, pd.DataFrame]:
    """Train a new model; equal arguments give equal numbers on the same machine.

    Args:
        checkpoint: file written after every epoch. If it holds a training of the same settings,
            seed and samples, the training continues from it.
        with_evidence: whether a SCENE-Net in metres says of each of its numbers whether the crops
            determine it. That may take as long as its search; a model that is only scored needs
            none.

    Returns:
        the model after the last epoch, and its history (see ``train``).

    Raises:
        InputError: there is no voxel labelled with the target to train on, or the training
            diverged (``scenenet.training.gradient.LostTraining``).
    """
    if not any(sample.labelled.any() for sample in training):
        raise InputError(
            f"no {settings.finds.name} voxel in the {len(training)} training crops",
            remedy="Add labelled crops, and check that their class scheme is the right one",
        )
    state = Checkpoint(checkpoint, identity_of(training, validation, settings, seed))
    if settings.kind == "scenenet" and settings.protocol == "operational":
        return fit_by_search(
            training, validation, settings, seed, state, with_evidence=with_evidence
        )
    return fit_by_gradient(training, validation, settings, seed, state)
