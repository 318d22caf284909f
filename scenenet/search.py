"""The numbers of a SCENE-Net in metres, found without a gradient (docs/accuracy.md).

Eleven numbers need no gradient, and the one of the thesis' loss is the reason for dead starts:
where the observer is negative, ReLU lets none through. Here whole sets of numbers are drawn, scored
on the training crops, and drawn again about the better ones: the covariance matrix adaptation of
Hansen (2016, arXiv:1604.00772). The search begins at the best of many draws over the whole ranges,
so it never begins where nothing is found as long as any of the draws finds something.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch

from scenenet.batches import batch
from scenenet.coarse import block_edge, coarsened
from scenenet.convolution import Occupancy, convolve_at_voxels
from scenenet.metrics import BETA, THRESHOLDS, ThresholdCurve
from scenenet.models import SceneNet
from scenenet.protocol import Measurement
from scenenet.sections import strongest
from scenenet.voxels import VoxelSample

LARGEST_STEP = 1.0
"""Of the search, in units of the logit: beyond it most draws lie at a bound."""
NEAR_BEST = 0.01
"""Where the middle of the search scores no less than this below the best draw ever made, it is
taken: a draw is the best of many by luck too."""


def _coarse_steps() -> np.ndarray:
    observed = np.arctanh(THRESHOLDS)
    wanted = np.exp(np.arange(np.log(observed[0]), np.log(observed[-1]), APART))
    return np.unique(np.searchsorted(observed, wanted * (1 - 1e-9)))


APART = 0.05
"""Share by which the thresholds that are tried differ in the observer's answer."""
STEPS = _coarse_steps()
"""Their numbers in ``scenenet.metrics.THRESHOLDS``, ascending."""


@dataclass(frozen=True)
class Scene:
    """A crop, ready to be answered many times.

    Attributes:
        observed: its voxels, or the blocks of them that a fine grid is observed through.
        voxel_size: m, edge of these.
        section: the others in the section of each (``scenenet.sections``).
        row: (M,) the one that each occupied voxel of the crop lies in.
        tower: (M,) bool, the truth.
        n_voxels: all voxels of the crop, empty ones included.
    """

    observed: Occupancy
    voxel_size: float
    section: tuple[np.ndarray, np.ndarray]
    row: np.ndarray
    tower: np.ndarray
    n_voxels: int


def scenes_of(
    model: SceneNet, samples: Sequence[VoxelSample], measurement: Measurement
) -> list[Scene]:
    """The crops of ``samples`` as ``model`` takes them."""
    scenes = []
    for sample in samples:
        occupancy, _ = batch([sample], measurement)
        edge = block_edge(sample.grid.voxel_size)
        observed, row = coarsened(occupancy, edge)
        size = edge * sample.grid.voxel_size
        section = model.at(size).section(observed)
        scenes.append(Scene(observed, size, section, row, sample.tower, sample.grid.n_voxels))
    return scenes


def answers(model: SceneNet, scene: Scene) -> np.ndarray:
    """Probability of each occupied voxel, (M,) float32; that of the others is 0."""
    kernel, _ = model.at(scene.voxel_size).observer()
    observed = convolve_at_voxels(scene.observed, kernel.detach()[None])[0].numpy()
    spoken = observed[strongest(observed, *scene.section)]
    return np.tanh(np.maximum(spoken, 0))[scene.row]


def curve_of(model: SceneNet, scenes: Sequence[Scene]) -> ThresholdCurve:
    """Scores at every tau over all voxels, empty ones included."""
    total = ThresholdCurve.empty()
    with torch.no_grad():
        for scene in scenes:
            curve = ThresholdCurve.of(answers(model, scene), scene.tower)
            curve.false[0] += scene.n_voxels - len(scene.tower)
            total += curve
    return total


def best_step(curve: ThresholdCurve, false_weight: float) -> tuple[int, float]:
    """The threshold with the highest F0.5 if a false voxel counts ``false_weight`` times.

    Only ``STEPS`` are tried. Between finer ones the choice falls on where a few voxels of the crops
    at hand happen to lie, and does not carry over to others.

    Returns:
        its number in ``THRESHOLDS``, the highest in a tie, and that F0.5.
    """
    tp = curve.true[::-1].cumsum()[::-1][1:]
    fp = curve.false[::-1].cumsum()[::-1][1:]
    b2 = BETA**2
    found = (1 + b2) * tp
    below = found + b2 * (int(curve.true.sum()) - tp) + false_weight * fp
    f05 = (found / np.maximum(below, 1e-12))[STEPS]
    highest = len(f05) - 1 - int(np.argmax(f05[::-1]))
    return int(STEPS[highest]), float(f05[highest])


@dataclass(frozen=True)
class State:
    """Where a search stands; P trained numbers.

    Attributes:
        mean: (P,) middle of the next draws.
        step: their spread.
        covariance: (P, P) its shape.
        path, step_path: (P,) where the middle has been going.
        best: (P,) the best draw so far, and ``best_score``, its score.
    """

    mean: np.ndarray
    step: float
    covariance: np.ndarray
    path: np.ndarray
    step_path: np.ndarray
    best: np.ndarray
    best_score: float
    generation: int


Score = Callable[[np.ndarray], float]


def begin(starts: np.ndarray, score: Score, step: float) -> State:
    """Begin at the best of ``starts`` (S, P)."""
    scores = [score(start) for start in starts]
    first = starts[int(np.argmax(scores))]
    n = len(first)
    return State(first, step, np.eye(n), np.zeros(n), np.zeros(n), first, max(scores), 0)


def advance(state: State, score: Score, population: int, rng: np.random.Generator) -> State:
    """One generation: draw about the mean, score, and move towards the better half.

    The constants are those of Hansen (2016), Table 1, without negative weights.
    """
    n, parents = len(state.mean), population // 2
    weight = np.log(parents + 0.5) - np.log(np.arange(1, parents + 1))
    weight /= weight.sum()
    effective = 1 / float((weight**2).sum())
    c_path = (4 + effective / n) / (n + 4 + 2 * effective / n)
    c_step = (effective + 2) / (n + effective + 5)
    c_one = 2 / ((n + 1.3) ** 2 + effective)
    c_rank = min(1 - c_one, 2 * (effective - 2 + 1 / effective) / ((n + 2) ** 2 + effective))
    damping = 1 + 2 * max(0.0, float(np.sqrt((effective - 1) / (n + 1))) - 1) + c_step
    expected = np.sqrt(n) * (1 - 1 / (4 * n) + 1 / (21 * n**2))

    variance, axes = np.linalg.eigh(state.covariance)
    deviation = np.sqrt(np.maximum(variance, 1e-14))
    drawn = (rng.standard_normal((population, n)) * deviation) @ axes.T
    tried = state.mean + state.step * drawn
    scores = np.array([score(one) for one in tried])
    order = np.argsort(-scores, kind="stable")[:parents]
    move = weight @ drawn[order]
    whitened = axes @ ((axes.T @ move) / deviation)
    step_path = (1 - c_step) * state.step_path
    step_path += np.sqrt(c_step * (2 - c_step) * effective) * whitened
    length = float(np.linalg.norm(step_path))
    unbiased = length / np.sqrt(1 - (1 - c_step) ** (2 * (state.generation + 1)))
    going = unbiased / expected < 1.4 + 2 / (n + 1)
    path = (1 - c_path) * state.path
    path += going * np.sqrt(c_path * (2 - c_path) * effective) * move
    covariance = (1 - c_one - c_rank) * state.covariance
    covariance += c_one * np.outer(path, path)
    covariance += c_rank * (drawn[order].T * weight) @ drawn[order]
    step = state.step * float(np.exp((c_step / damping) * (length / expected - 1)))
    top = order[0]
    better = scores[top] > state.best_score
    return State(
        state.mean + state.step * move,
        min(step, LARGEST_STEP),
        covariance,
        path,
        step_path,
        tried[top] if better else state.best,
        float(scores[top]) if better else state.best_score,
        state.generation + 1,
    )


def settled(state: State, score: Score) -> State:
    """The state with its answer in ``best``: the middle of the search unless the best draw is
    clearly better."""
    middle = score(state.mean)
    if middle < state.best_score - NEAR_BEST:
        return state
    return replace(state, best=state.mean, best_score=middle)


def scorer(model: SceneNet, scenes: Sequence[Scene]) -> Score:
    """The score of a set of numbers: the F0.5 of ``best_step`` at its own best tau."""
    assert model.field is not None
    false_weight = model.field.false_weight

    def score(numbers: np.ndarray) -> float:
        model.set_numbers(numbers)
        return best_step(curve_of(model, scenes), false_weight)[1]

    return score


def draws(model: SceneNet, n: int, rng: np.random.Generator) -> np.ndarray:
    """(n, P) numbers over the whole ranges; the mixing weights evenly over all there can be."""
    n_mixing = len(model.names) - 1
    share = rng.uniform(0.03, 0.97, (n, model.n_parameters() - n_mixing))
    shapes = np.log(share / (1 - share))
    weights = np.maximum(rng.dirichlet(np.ones(n_mixing + 1), n), 1e-3)
    return np.concatenate([shapes, np.log(weights[:, :-1] / weights[:, -1:])], axis=1)
