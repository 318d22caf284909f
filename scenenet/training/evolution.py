"""The state of a search by CMA-ES (Hansen 2016), one generation at a time, with ``cmaes``.

The library keeps its state in private attributes. A search is therefore stored as its seed and its
scores: with both, the library draws and moves again exactly as it did before.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from cmaes import CMA

NEAR_BEST = 0.01
"""The mean of the search is returned if it scores no less than this below the best draw: a draw is
the best of many by luck too."""


@dataclass(frozen=True)
class State:
    """Where a search stands; P trained numbers.

    Attributes:
        first: (P,) where the search starts.
        step: initial step size.
        seed: of all draws.
        scores: (G, K) score of each of the K draws of the G generations so far.
        best: (P,) the best draw so far, and ``best_score``, its score.
        live: the library's search, which moves on with each generation; None after a restart. It
            is not part of the state, which follows from the seed and the scores.
    """

    first: np.ndarray
    step: float
    seed: int
    scores: np.ndarray
    best: np.ndarray
    best_score: float
    live: CMA | None = field(default=None, compare=False, repr=False)

    @property
    def generation(self) -> int:
        """Number of generations so far."""
        return len(self.scores)

    def search(self) -> CMA:
        """The library's search in this state: ``live``, unless it has moved on since. Otherwise
        all generations run again, at 2 ms each."""
        if self.live is not None and self.live.generation == self.generation:
            return self.live
        from cmaes import CMA

        population = self.scores.shape[1]
        first = self.first.copy()  # which the library changes in place
        search = CMA(first, self.step, population_size=population)
        for generation, scores in enumerate(self.scores):
            _tell(search, _draw(search, [self.seed, generation]), scores)
        return search


Score = Callable[[np.ndarray], float]


def begin(
    starts: np.ndarray, score: Score, step: float, population: int, entropy: list[int]
) -> State:
    """Begin at the best of ``starts`` (S, P).

    Args:
        score: to be maximised.
        step: initial step size.
        population: draws per generation.
        entropy: seed of all draws.
    """
    scores = [score(start) for start in starts]
    first = starts[int(np.argmax(scores))]
    return State(first, step, _seed(entropy), np.empty((0, population)), first, max(scores))


def advance(state: State, score: Score) -> State:
    """One generation: draw, score, and move towards the better draws."""
    search = state.search()
    drawn = _draw(search, [state.seed, state.generation])
    scores = np.array([score(one) for one in drawn])
    _tell(search, drawn, scores)
    top = int(np.argmax(scores))
    state = replace(state, scores=np.concatenate([state.scores, scores[None]]), live=search)
    if scores[top] > state.best_score:
        return replace(state, best=drawn[top], best_score=float(scores[top]))
    return state


def settled(state: State, score: Score) -> State:
    """The state with the result of the search in ``best``.

    This is the mean of the search, unless the best draw is clearly better.
    """
    mean = state.search().mean.copy()
    middle = score(mean)
    if middle < state.best_score - NEAR_BEST:
        return state
    return replace(state, best=mean, best_score=middle)


def _draw(search: CMA, entropy: list[int]) -> list[np.ndarray]:
    """The draws of a generation, which depend on its seed alone."""
    search.reseed_rng(_seed(entropy))
    return [search.ask() for _ in range(search.population_size)]


def _seed(entropy: list[int]) -> int:
    return int(np.random.SeedSequence(entropy).generate_state(1)[0])


def _tell(search: CMA, drawn: list[np.ndarray], scores: np.ndarray) -> None:
    """Give the library the scores of its draws; it minimises."""
    search.tell(list(zip(drawn, -scores, strict=True)))
