"""Training of protocol ``operational``: the numbers of a SCENE-Net in metres are searched for."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from scenenet.core.files import atomic
from scenenet.core.progress import track
from scenenet.dataset.voxels import VoxelSample
from scenenet.metrics.score_columns import or_nan
from scenenet.models.factory import new_model
from scenenet.models.metric_scenenet import MetricSceneNet
from scenenet.models.predictions import PreparedCrop, curve_of, prepare_crops
from scenenet.models.settings import ModelSettings, SearchSettings
from scenenet.training.cma_es import Score, State, advance, begin, settled
from scenenet.training.objective import draws, scorer


def search_metric(
    training: Sequence[VoxelSample],
    validation: Sequence[VoxelSample],
    settings: ModelSettings,
    seed: int,
    identity: str,
    *,
    checkpoint: Path | None = None,
) -> tuple[MetricSceneNet, pd.DataFrame]:
    """Search for the numbers of a new SCENE-Net in metres; as ``scenenet.training.train.fit``.

    A row of the history is a generation of the search: loss is 1 - F0.5 on the training crops, as
    the search weighs it, of the best numbers so far, whose parameters follow. Several searches are
    begun, and the rows are those of the one that was gone on with; ``search`` is its number.

    Args:
        identity: of all that a checkpoint depends on.
    """
    model = new_model(settings, seed)
    assert isinstance(model, MetricSceneNet)
    learnt = prepare_crops(model, training, settings.measurement)
    kept = prepare_crops(model, validation, settings.measurement)
    score = scorer(model, learnt)
    search = settings.search

    def row(state: State, seconds: float) -> dict[str, float]:
        model.set_numbers(state.best)
        return _row(model, state, kept, seconds)

    state, history = _resume(checkpoint, identity)
    if state is None:
        started = time.perf_counter()
        trials = [_trial(model, score, search, [seed, n]) for n in range(search.searches)]
        chosen = max(range(len(trials)), key=lambda n: trials[n][-1].best_score)
        each = (time.perf_counter() - started) / max(1, search.trial)
        state = trials[chosen][-1]
        history = [row(s, each) | {"search": chosen} for s in trials[chosen][1:]]
    chosen = int(history[0]["search"]) if history else 0
    label = f"{settings.name} seed {seed}: generations"
    for generation in track(range(state.generation + 1, search.generations + 1), label):
        started = time.perf_counter()
        # The draws follow from these numbers alone: a resumed search draws the same.
        rng = np.random.default_rng([seed, chosen, generation])
        state = advance(state, score, search.population, rng)
        if generation == search.generations:
            state = settled(state, score)
        history.append(row(state, time.perf_counter() - started) | {"search": chosen})
        if checkpoint is not None:
            _save(checkpoint, identity, state, history)
    model.set_numbers(state.best)
    return model, pd.DataFrame(history)


def _trial(
    model: MetricSceneNet, score: Score, settings: SearchSettings, entropy: list[int]
) -> list[State]:
    """The first generations of a search, its beginning included.

    Some searches end where the negative sphere has no weight and no draw about them is better, so
    several are begun.
    """
    starts = draws(model, settings.starts, np.random.default_rng([*entropy, 0]))
    states = [begin(starts, score, settings.step)]
    for generation in range(1, min(settings.trial, settings.generations - 1) + 1):
        rng = np.random.default_rng([*entropy, generation])
        states.append(advance(states[-1], score, settings.population, rng))
    return states


def _row(
    model: MetricSceneNet, state: State, kept: Sequence[PreparedCrop], seconds: float
) -> dict[str, float]:
    loss = 1 - state.best_score
    row = {"epoch": state.generation, "loss": loss, "fidelity": loss, "penalty": 0.0}
    row["seconds"] = seconds
    row |= {"validation_loss": float("nan"), "validation_f05": float("nan")}
    if kept:
        curve = curve_of(model, kept)
        row["validation_loss"] = 1 - model.best_step(curve)[1]
        row["validation_f05"] = or_nan(curve.best()[1].f05)
    return row | model.shape_parameters()


def _save(path: Path, identity: str, state: State, history: list[dict[str, float]]) -> None:
    from safetensors.numpy import save_file

    fields = asdict(state)
    arrays = {k: np.ascontiguousarray(v) for k, v in fields.items() if isinstance(v, np.ndarray)}
    plain = {k: v for k, v in fields.items() if k not in arrays}
    metadata = {
        "identity": identity,
        "state": json.dumps(plain),
        "history": json.dumps(history),
    }
    with atomic(path) as partial:
        save_file(arrays, partial, metadata=metadata)


def _resume(path: Path | None, identity: str) -> tuple[State | None, list[dict[str, Any]]]:
    """State and history of a checkpoint; none where none fits."""
    if path is None or not path.is_file():
        return None, []
    from safetensors import SafetensorError, safe_open

    try:
        with safe_open(path, framework="np") as stream:
            metadata = stream.metadata() or {}
            if metadata.get("identity") != identity or "state" not in metadata:
                return None, []
            arrays = {name: stream.get_tensor(name) for name in list(stream.keys())}
    except SafetensorError:  # damaged: the search begins anew, which costs time and no result
        return None, []
    return State(**arrays, **json.loads(metadata["state"])), json.loads(metadata["history"])
