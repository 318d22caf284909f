"""Training by gradient (thesis 5.2.1)."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
import torch

from scenenet.core.errors import InputError
from scenenet.core.progress import track
from scenenet.dataset.batches import batch
from scenenet.dataset.voxels import VoxelSample
from scenenet.metrics.score_columns import or_nan
from scenenet.models.base import VoxelModel
from scenenet.models.geneo_model import GeneoModel
from scenenet.models.predictions import EVALUATED_AT_ONCE, threshold_curve
from scenenet.models.settings import ModelSettings, TrainingSettings
from scenenet.training.checkpoint import Checkpoint, State
from scenenet.training.initialisation import starting_model
from scenenet.training.losses import VoxelWeights, fidelity, negativity
from scenenet.training.optimiser import Optimiser

History = list[dict[str, float]]
"""A row per epoch; the columns are those of ``scenenet.training.train.train``."""


class LostTraining(InputError):
    """The loss or a parameter is no longer a finite number."""


def fit_by_gradient(
    training: Sequence[VoxelSample],
    validation: Sequence[VoxelSample],
    settings: ModelSettings,
    seed: int,
    checkpoint: Checkpoint,
) -> tuple[VoxelModel, pd.DataFrame]:
    """Train a new model by gradient; arguments and result as for ``scenenet.training.train.fit``.

    Raises:
        LostTraining: the loss or a parameter is no longer a finite number.
    """
    protocol = settings.training
    model = starting_model(settings, seed, training)
    optimiser = Optimiser(protocol.optimiser, model.parameters())
    n_tower = sum(int(sample.labelled.sum()) for sample in training)
    n_voxels = sum(sample.grid.n_voxels for sample in training)
    weights = VoxelWeights.of_counts(n_tower, n_voxels, protocol.loss.alpha, protocol.loss.epsilon)
    history = _resume(checkpoint, model, optimiser)
    label = f"{settings.name} seed {seed}: epochs"
    for epoch in track(range(len(history) + 1, protocol.epochs + 1), label):
        started = time.perf_counter()
        # The rate depends on the epoch alone, so a resumed training continues at the same rate.
        rate = protocol.rate(epoch)
        row = _epoch(model, optimiser, rate, training, settings, weights, [seed, epoch])
        row["seconds"] = time.perf_counter() - started
        if not np.isfinite(row["loss"]) or not all(p.isfinite().all() for p in model.parameters()):
            raise LostTraining(
                f"the training of {settings.name} from seed {seed} diverged: after epoch {epoch} "
                f"a parameter or the loss ({row['loss']}) is not finite",
                remedy="Set a lower training.learning_rate",
            )
        row |= _validate(model, validation, settings, weights)
        if isinstance(model, GeneoModel):
            row |= model.shape_parameters()
        history.append({"epoch": epoch} | row)
        checkpoint.write(_state(model, optimiser, history))
    return model, pd.DataFrame(history)


def _epoch(
    model: VoxelModel,
    optimiser: Optimiser,
    rate: float,
    training: Sequence[VoxelSample],
    settings: ModelSettings,
    weights: VoxelWeights,
    entropy: list[int],
) -> dict[str, float]:
    """One pass over the shuffled training set; mean loss over its crops."""
    protocol: TrainingSettings = settings.training
    # The order depends on seed and epoch alone, so a resumed training draws the same batches.
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
        optimiser.step(rate)
        for name, value in zip(sums, (loss, error, penalty), strict=True):
            sums[name] += value.item() * len(chosen)
    return {name: value / len(order) for name, value in sums.items()}


def _validate(
    model: VoxelModel,
    validation: Sequence[VoxelSample],
    settings: ModelSettings,
    weights: VoxelWeights,
) -> dict[str, float]:
    """Loss and best F0.5 on the validation crops; NaN if there are none."""
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


def _state(model: VoxelModel, optimiser: Optimiser, history: History) -> State:
    tensors = {f"model/{name}": value for name, value in model.state_dict().items()}
    for number, state in optimiser.state.items():
        tensors |= {f"optimiser/{number}/{key}": value for key, value in state.items()}
    return State({name: value.detach().numpy() for name, value in tensors.items()}, history)


def _resume(checkpoint: Checkpoint, model: VoxelModel, optimiser: Optimiser) -> History:
    """Load model and optimiser from the checkpoint, and return its history; an empty one if the
    training starts from the beginning."""
    saved = checkpoint.read()
    if saved is None:
        return []
    weights: dict[str, torch.Tensor] = {}
    state: dict[int, dict[str, Any]] = {}
    for name, array in saved.arrays.items():
        part, _, rest = name.partition("/")
        if part == "model":
            weights[rest] = torch.from_numpy(array)
        else:
            number, _, key = rest.partition("/")
            state.setdefault(int(number), {})[key] = torch.from_numpy(array)
    model.load_state_dict(weights)
    optimiser.load(state)
    return saved.record
