"""Training of protocol ``operational``: a search for the numbers of a SCENE-Net in metres."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from scenenet.core.progress import track
from scenenet.dataset.voxels import VoxelSample
from scenenet.metrics.score_columns import or_nan
from scenenet.metrics.threshold_curve import ThresholdCurve
from scenenet.models.factory import new_model
from scenenet.models.known_answers import KnownAnswers
from scenenet.models.metric_scenenet import MetricSceneNet
from scenenet.models.predictions import PreparedCrop, crop_curves, curve_of, prepare_crops
from scenenet.models.settings import ModelSettings, SearchSettings
from scenenet.training import checkpoint as checkpoints
from scenenet.training.determination import evidence
from scenenet.training.evolution import Score, State, advance, begin, settled
from scenenet.training.measured_numbers import FreeNumbers, measure
from scenenet.training.objective import draws, near_the_best, scorer
from scenenet.training.one_error import left_out, within_one_error


def fit_by_search(
    training: Sequence[VoxelSample],
    validation: Sequence[VoxelSample],
    settings: ModelSettings,
    seed: int,
    checkpoint: checkpoints.Checkpoint,
    *,
    with_evidence: bool = True,
) -> tuple[MetricSceneNet, pd.DataFrame]:
    """Search for the numbers of a new SCENE-Net in metres.

    Arguments and result are those of ``scenenet.training.train.fit``. A row of the history is a
    generation of the search: loss is 1 - F0.5 of the best numbers so far on the training crops, as
    the search weighs it, followed by the parameters. Several searches start, and the best of them
    continues; the rows are those of that one, and ``search`` is its number. Numbers that are
    measured or fixed are not searched for (``scenenet.training.measured_numbers``). With
    ``search.result`` ``middle`` there is one row, of the mean of many draws.
    """
    model = new_model(settings, seed)
    assert isinstance(model, MetricSceneNet)
    measured = measure(model, training)
    lengths = {label: found.value for label, found in measured.items()}
    model.set_shape_parameters(model.shape_parameters() | lengths)
    free = FreeNumbers(model, measured)
    learnt = prepare_crops(model, training, settings.measurement)
    kept = prepare_crops(model, validation, settings.measurement)
    if settings.search.result == "middle":
        history = [_middle(free, learnt, settings, seed, kept)]
    else:
        history = _generations(free, scorer(free, learnt), settings, seed, kept, checkpoint)
    if with_evidence:
        known = KnownAnswers()
        model.evidence = evidence(
            model, measured, lambda: model.best_step(curve_of(model, learnt, known))[1]
        )
    return model, pd.DataFrame(history)


def _generations(
    free: FreeNumbers,
    score: Score,
    settings: ModelSettings,
    seed: int,
    kept: Sequence[PreparedCrop],
    checkpoint: checkpoints.Checkpoint,
) -> list[dict[str, Any]]:
    """Search generation by generation, and set the best numbers; the rows of the history."""
    search = settings.search

    def row(state: State, seconds: float) -> dict[str, float]:
        free.set(state.best)
        return _row(free.model, state.generation, state.best_score, kept, seconds)

    state, history = _resume(checkpoint)
    if state is None:
        started = time.perf_counter()
        trials = [_trial(free, score, search, [seed, n]) for n in range(search.searches)]
        chosen = max(range(len(trials)), key=lambda n: trials[n][-1].best_score)
        each = (time.perf_counter() - started) / max(1, search.trial)
        state = trials[chosen][-1]
        history = [row(s, each) | {"search": chosen} for s in trials[chosen][1:]]
    chosen = int(history[0]["search"]) if history else 0
    label = f"{settings.name} seed {seed}: generations"
    for generation in track(range(state.generation + 1, search.generations + 1), label):
        started = time.perf_counter()
        state = advance(state, score)
        if generation == search.generations:
            state = settled(state, score)
        history.append(row(state, time.perf_counter() - started) | {"search": chosen})
        _save(checkpoint, state, history)
    free.set(state.best)
    return history


def _middle(
    free: FreeNumbers,
    crops: Sequence[PreparedCrop],
    settings: ModelSettings,
    seed: int,
    kept: Sequence[PreparedCrop],
) -> dict[str, Any]:
    """Set the mean of all draws that score hardly less than the best one (``search.hardly``); the
    row of the history.

    Where the score is the same over a wide range, the best draw lies anywhere in it, and the middle
    is furthest from the numbers that do not fit.
    """
    started, model, known = time.perf_counter(), free.model, KnownAnswers()
    search, rng = settings.search, np.random.default_rng([seed, 0])
    near = math.floor(search.near_best * search.starts)
    over_all = free.of(draws(model, search.starts - near, rng))
    numbers, scores, without = [], [], []

    def look(drawn: np.ndarray, where: str) -> None:
        for one in track(list(drawn), f"{settings.name} seed {seed}: draws {where}"):
            free.set(one)
            curves = list(crop_curves(model, crops, known))
            step, score = model.best_step(sum(curves, ThresholdCurve.empty()))
            numbers.append(model.shape_parameters())
            scores.append(score)
            without.append(left_out(curves, step, model.metric.false_weight))

    look(over_all, "over the whole range")
    if near:
        look(near_the_best(over_all, scores, near, rng), "near the best")
    reached = np.array(scores)
    if search.hardly is None:
        within = within_one_error(reached, np.array(without))
    else:
        within = reached >= reached.max() - search.hardly
    good = [each for each, counts in zip(numbers, within, strict=True) if counts]
    # Means of weights that sum to one sum to one, and means of bounded lengths stay in bounds.
    model.set_shape_parameters(
        {name: float(np.mean([each[name] for each in good])) for name in good[0]}
    )
    _, score = model.best_step(curve_of(model, crops, known))
    return _row(model, 1, score, kept, time.perf_counter() - started)


def _trial(
    free: FreeNumbers, score: Score, settings: SearchSettings, entropy: list[int]
) -> list[State]:
    """The start and the first generations of a search.

    Some searches end with a negative sphere of weight 0, around which no draw is better. This is
    why several searches start.
    """
    starts = free.of(draws(free.model, settings.starts, np.random.default_rng([*entropy, 0])))
    states = [begin(starts, score, settings.step, settings.population, entropy)]
    for _ in range(min(settings.trial, settings.generations - 1)):
        states.append(advance(states[-1], score))
    return states


def _row(
    model: MetricSceneNet,
    generation: int,
    reached: float,
    kept: Sequence[PreparedCrop],
    seconds: float,
) -> dict[str, float]:
    loss = 1 - reached
    row = {"epoch": generation, "loss": loss, "fidelity": loss, "penalty": 0.0}
    row["seconds"] = seconds
    row |= {"validation_loss": float("nan"), "validation_f05": float("nan")}
    if kept:
        curve = curve_of(model, kept)
        row["validation_loss"] = 1 - model.best_step(curve)[1]
        row["validation_f05"] = or_nan(curve.best()[1].f05)
    return row | model.shape_parameters()


def _save(
    checkpoint: checkpoints.Checkpoint, state: State, history: list[dict[str, float]]
) -> None:
    fields = {name: value for name, value in vars(state).items() if name != "live"}
    arrays = {name: value for name, value in fields.items() if isinstance(value, np.ndarray)}
    plain = {name: value for name, value in fields.items() if name not in arrays}
    checkpoint.write(checkpoints.State(arrays, {"state": plain, "history": history}))


def _resume(
    checkpoint: checkpoints.Checkpoint,
) -> tuple[State | None, list[dict[str, Any]]]:
    saved = checkpoint.read()
    if saved is None:
        return None, []
    fields: dict[str, Any] = {**saved.arrays, **saved.record["state"]}
    return State(**fields), saved.record["history"]
