"""The training loop (thesis 5.2.1)."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import torch

from scenenet.core.errors import InputError
from scenenet.core.files import atomic, digest
from scenenet.core.progress import track
from scenenet.dataset.batches import batch
from scenenet.dataset.split import crops_in
from scenenet.dataset.voxel_cache import Dataset, load
from scenenet.dataset.voxels import VoxelSample, VoxelSettings
from scenenet.metrics.score_columns import or_nan
from scenenet.models.base import VoxelModel
from scenenet.models.geneo_model import GeneoModel
from scenenet.models.model_file import ModelCard, write_model
from scenenet.models.predictions import EVALUATED_AT_ONCE, threshold_curve
from scenenet.models.settings import ModelSettings, TrainingSettings
from scenenet.training.initialisation import starting_model
from scenenet.training.losses import VoxelWeights, fidelity, negativity
from scenenet.training.metric_search import search_metric

OPTIMISERS = {"rmsprop": torch.optim.RMSprop, "adam": torch.optim.Adam, "sgd": torch.optim.SGD}


class LostTraining(InputError):
    """The loss became something that is not a number."""


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
    """Train one model with one seed on the training part and write it with its history.

    Args:
        voxel_manifests: of the voxel stores, all of the same grid.
        split: CSV file of ``scenenet.dataset.split``.
        out_history: CSV file, a row an epoch: epoch, loss, fidelity, penalty, validation_loss,
            validation_f05, seconds, and for SCENE-Net a column per parameter.
        checkpoint: file that an interrupted training goes on from; gone when it has ended.
        provenance: kept in the model file beside seed and data fingerprint.
    """
    training = load(voxel_manifests, crops_in(split, "train"))
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
        measurement=model.measurement,
        fit=grid.fit,
        resolution=grid.resolution,
        voxel_size=float(np.median([s.grid.voxel_size for s in training.samples])),
        provenance={
            "seed": seed,
            "data": digest(sorted(training.content)),
            "training_crops": len(training.samples),
            "protocol": model.protocol,
            **_how_trained(model),
            **provenance,
        },
    )


def _how_trained(model: ModelSettings) -> dict[str, Any]:
    settings = model.model_dump(mode="json")
    found: dict[str, Any] = {k: settings[k] for k in ("training", "search") if k in settings}
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
) -> tuple[VoxelModel, pd.DataFrame]:
    """Train a new model; the same arguments give the same numbers on the same machine.

    Args:
        checkpoint: file written after every epoch. Where it exists and is of the same settings,
            seed and samples, training goes on from it.

    Returns:
        the model after the last epoch, and its history (see ``train``).

    Raises:
        InputError: there is no tower voxel to train on.
        LostTraining: the numbers ran away; a lower learning rate may keep them.
    """
    if not any(sample.tower.any() for sample in training):
        raise InputError(
            f"no tower voxel in the {len(training)} training crops",
            remedy="Add labelled crops, and check that their class scheme is the right one",
        )
    protocol = settings.training
    identity = _identity(training, validation, settings, seed)
    if settings.protocol == "operational" and settings.kind == "scenenet":
        return search_metric(training, validation, settings, seed, identity, checkpoint=checkpoint)
    model = starting_model(settings, seed, training)
    optimiser = OPTIMISERS[protocol.optimiser](model.parameters(), lr=protocol.learning_rate)
    n_tower = sum(int(sample.tower.sum()) for sample in training)
    n_voxels = sum(sample.grid.n_voxels for sample in training)
    weights = VoxelWeights.of_counts(n_tower, n_voxels, protocol.loss.alpha, protocol.loss.epsilon)
    history = _resume(checkpoint, identity, model, optimiser)
    label = f"{settings.name} seed {seed}: epochs"
    for epoch in track(range(len(history) + 1, protocol.epochs + 1), label):
        started = time.perf_counter()
        # It follows from the epoch alone, so a resumed training goes on at the same rate.
        for group in optimiser.param_groups:
            group["lr"] = protocol.rate(epoch)
        row = _epoch(model, optimiser, training, settings, weights, [seed, epoch])
        row["seconds"] = time.perf_counter() - started
        if not np.isfinite(row["loss"]):
            raise LostTraining(
                f"training {settings.name} from seed {seed} lost its way: the loss of epoch "
                f"{epoch} is {row['loss']}",
                remedy="Set a lower training.learning_rate",
            )
        row |= _validate(model, validation, settings, weights)
        if isinstance(model, GeneoModel):
            row |= model.shape_parameters()
        history.append({"epoch": epoch} | row)
        if checkpoint is not None:
            _save(checkpoint, identity, model, optimiser, history)
    return model, pd.DataFrame(history)


def _epoch(
    model: VoxelModel,
    optimiser: torch.optim.Optimizer,
    training: Sequence[VoxelSample],
    settings: ModelSettings,
    weights: VoxelWeights,
    entropy: list[int],
) -> dict[str, float]:
    """One pass over the shuffled training set; mean loss over its crops."""
    protocol: TrainingSettings = settings.training
    # The order follows from seed and epoch alone, so a resumed training draws the same batches.
    order = np.random.default_rng(entropy).permutation(len(training))
    sums = {"loss": 0.0, "fidelity": 0.0, "penalty": 0.0}
    for start in range(0, len(order), protocol.batch_size):
        chosen = [training[i] for i in order[start : start + protocol.batch_size]]
        occupancy, towers = batch(chosen, settings.measurement)
        optimiser.zero_grad()
        error = fidelity(model, occupancy, towers, weights, protocol.loss.fidelity)
        penalty = negativity(model, protocol.loss)
        loss = error + penalty
        loss.backward()
        optimiser.step()
        for name, value in zip(sums, (loss, error, penalty), strict=True):
            sums[name] += value.item() * len(chosen)
    return {name: value / len(order) for name, value in sums.items()}


def _validate(
    model: VoxelModel,
    validation: Sequence[VoxelSample],
    settings: ModelSettings,
    weights: VoxelWeights,
) -> dict[str, float]:
    """Loss and best F0.5 on the validation part; NaN where there is none."""
    if not validation:
        return {"validation_loss": float("nan"), "validation_f05": float("nan")}
    errors, sizes = [], []
    with torch.no_grad():
        for start in range(0, len(validation), EVALUATED_AT_ONCE):
            chosen = validation[start : start + EVALUATED_AT_ONCE]
            occupancy, towers = batch(chosen, settings.measurement)
            kind = settings.training.loss.fidelity
            errors.append(fidelity(model, occupancy, towers, weights, kind).item())
            sizes.append(occupancy.n_voxels)
    curve = threshold_curve(model, validation, settings.measurement)
    return {
        "validation_loss": float(np.average(errors, weights=sizes)),
        "validation_f05": or_nan(curve.best()[1].f05),
    }


def _identity(
    training: Sequence[VoxelSample],
    validation: Sequence[VoxelSample],
    settings: ModelSettings,
    seed: int,
) -> str:
    """Digest of all that a checkpoint depends on."""

    def print_of(sample: VoxelSample) -> list[Any]:
        return [sample.id, len(sample.index), int(sample.index.sum()), int(sample.tower.sum())]

    samples = [[print_of(s) for s in part] for part in (training, validation)]
    return digest([settings.model_dump(), seed, samples])


def _save(
    path: Path,
    identity: str,
    model: VoxelModel,
    optimiser: torch.optim.Optimizer,
    history: list[dict[str, float]],
) -> None:
    from safetensors.torch import save_file

    tensors = {f"model/{name}": value for name, value in model.state_dict().items()}
    for number, state in optimiser.state_dict()["state"].items():
        tensors |= {f"optimiser/{number}/{key}": value for key, value in state.items()}
    metadata = {"identity": identity, "history": json.dumps(history)}
    with atomic(path) as partial:
        save_file({k: v.clone() for k, v in tensors.items()}, partial, metadata=metadata)


def _resume(
    path: Path | None, identity: str, model: VoxelModel, optimiser: torch.optim.Optimizer
) -> list[dict[str, float]]:
    """Take model, optimiser and history from a checkpoint; an empty history where none fits."""
    if path is None or not path.is_file():
        return []
    from safetensors import SafetensorError, safe_open

    try:
        with safe_open(path, framework="pt") as stream:
            metadata = stream.metadata() or {}
            if metadata.get("identity") != identity:
                return []
            tensors = {name: stream.get_tensor(name) for name in list(stream.keys())}
    except SafetensorError:  # damaged: the training begins anew, which costs time and no result
        return []
    model.load_state_dict(
        {k.removeprefix("model/"): v for k, v in tensors.items() if k.startswith("model/")}
    )
    state: dict[int, dict[str, Any]] = {}
    for name, value in tensors.items():
        if name.startswith("optimiser/"):
            _, number, key = name.split("/")
            state.setdefault(int(number), {})[key] = value
    optimiser.load_state_dict(optimiser.state_dict() | {"state": state})
    return json.loads(metadata["history"])
