"""Answers of kernels that are asked for again and again while only mixing weights change."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import TypeVar

from torch import Tensor

from scenenet.convolution.occupancy import Occupancy

Result = TypeVar("Result")


class KnownAnswers:
    """The last kernels and answers of an observer, with the numbers that they depended on.

    A search for mixing weights asks for the answers of the same kernels in the same crops a
    thousand times. There is one result for each observer and crop, so that a search for shapes
    takes no more memory.

    Attributes:
        keeps_grids: whether answers are kept. They are not where each grid is seen only once.
    """

    def __init__(self) -> None:
        self.keeps_grids = True
        self._kernels: dict[Hashable, tuple[Hashable, object]] = {}
        # The grid is kept with its answers, so that its id stays its own.
        self._answers: dict[Hashable, tuple[Hashable, Occupancy, Tensor]] = {}

    def of_kernels(self) -> KnownAnswers:
        """The same kernels, without the answers."""
        other = KnownAnswers()
        other._kernels, other.keeps_grids = self._kernels, False
        return other

    def kernels(self, observer: Hashable, state: Hashable, make: Callable[[], Result]) -> Result:
        """The kernels of an ``observer``, made again if ``state`` is not that of the last ones."""
        known = self._kernels.get(observer)
        if known is None or known[0] != state:
            known = self._kernels[observer] = (state, make())
        return known[1]  # type: ignore[return-value]

    def answers(
        self, observer: Hashable, state: Hashable, grids: Occupancy, make: Callable[[], Tensor]
    ) -> Tensor:
        """The answers of an ``observer`` in ``grids``, made again if ``state`` is another one."""
        if not self.keeps_grids:
            return make()
        known = self._answers.get((observer, id(grids)))
        if known is None or known[0] != state:
            known = self._answers[observer, id(grids)] = (state, grids, make())
        return known[2]
