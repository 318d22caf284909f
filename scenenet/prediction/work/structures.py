"""The shapes of the towers of a survey, and the points that are theirs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from scenenet.detection.structure import Structure
from scenenet.detection.structure_record import from_record, to_record
from scenenet.prediction.work.lattice import Lattice, column_of, groups


@dataclass(frozen=True)
class Structures:
    """The shapes of towers, which say which points are whose.

    Attributes:
        numbered: id and shape of each tower. Points in two shapes belong to the earlier one.
    """

    numbered: tuple[tuple[int, Structure], ...]

    def by_column(self, lattice: Lattice) -> dict[tuple[int, int], list[tuple[int, Structure]]]:
        """(x, y) number of a column of tiles -> those that reach into it, in order."""
        found: dict[tuple[int, int], list[tuple[int, Structure]]] = {}
        for number, structure in self.numbered:
            x, y, reach = structure.x, structure.y, structure.reach
            for column in lattice.columns((x - reach, x + reach), (y - reach, y + reach)):
                found.setdefault(column, []).append((number, structure))
        return found

    def reaching(self, lattice: Lattice, codes: Iterable[int]) -> Structures:
        """Those that reach into the column of a tile with one of the ``codes``, in order."""
        near = self.by_column(lattice)
        columns = near.keys() & set(map(column_of, codes))
        numbers = {number for column in columns for number, _ in near[column]}
        return Structures(tuple(each for each in self.numbered if each[0] in numbers))

    def to_json(self) -> list[dict[str, Any]]:
        return [{"id": number, **to_record(shape)} for number, shape in self.numbered]

    @classmethod
    def from_json(cls, data: Iterable[Mapping[str, Any]]) -> Structures:
        """The structures that ``to_json`` gave, without their conductors."""
        return cls(tuple((each["id"], from_record(each)) for each in data))


class Owners:
    """Says which points are whose."""

    def __init__(self, structures: Structures, lattice: Lattice) -> None:
        """Sort the structures by place."""
        self._lattice, self._near = lattice, structures.by_column(lattice)

    def __call__(self, xyz: np.ndarray, codes: np.ndarray | None = None) -> np.ndarray:
        """(n,) uint32, id of the first tower whose shape has each of the points (n, 3) m, or 0.

        Args:
            codes: (n,) of the tiles of the points, if they are known.
        """
        owner = np.zeros(len(xyz), np.uint32)
        if codes is None:
            codes, _ = self._lattice.locate(xyz)
        for code, rows in groups(codes):
            free = rows
            for number, structure in self._near.get(column_of(code), ()):
                place = xyz[free]
                away = np.hypot(place[:, 0] - structure.x, place[:, 1] - structure.y)
                near = np.flatnonzero(away <= structure.reach)
                own = near[structure.contains(place[near])]
                owner[free[own]] = number
                free = np.delete(free, own)
        return owner
