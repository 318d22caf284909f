"""The fields of points besides coordinates and class, read where a measurement needs them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np

from scenenet.core.errors import InputError

if TYPE_CHECKING:
    import laspy

    from scenenet.pointcloud.cloud import PointCloud

PointField = Literal["intensity", "returns"]
"""What may be asked for: the intensity; number of the return and number of returns of its pulse."""
FIELDS: tuple[PointField, ...] = get_args(PointField)

TITLES: dict[PointField, str] = {"intensity": "intensity", "returns": "numbers of returns"}
"""The fields in words."""

_ARRAYS: dict[PointField, tuple[str, ...]] = {
    "intensity": ("intensity",),
    "returns": ("return_number", "number_of_returns"),
}
"""The arrays of each field, as LAS and ``PointFields`` call them."""


@dataclass(frozen=True)
class PointFields:
    """The fields of N points; None for those that were not asked for.

    Attributes:
        intensity: (N,) uint16.
        return_number: (N,) uint8, from 1.
        number_of_returns: (N,) uint8, of the pulse.
    """

    intensity: np.ndarray | None = None
    return_number: np.ndarray | None = None
    number_of_returns: np.ndarray | None = None

    def __len__(self) -> int:
        return max((len(array) for array in self.arrays().values()), default=0)

    @property
    def is_last(self) -> np.ndarray:
        """(N,) bool, which points are the last return of their pulse.

        Raises:
            ValueError: the returns were not asked for.
        """
        if self.return_number is None or self.number_of_returns is None:
            raise ValueError("the returns were not read; a measurement names them in its needs")
        return np.asarray(self.return_number >= self.number_of_returns)

    def arrays(self) -> dict[str, np.ndarray]:
        """Those that are there, by name."""
        found = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: array for name, array in found.items() if array is not None}

    def select(self, index: np.ndarray) -> PointFields:
        """Of the points at ``index`` (a mask or positions), in that order."""
        return PointFields(**{name: array[index] for name, array in self.arrays().items()})

    @classmethod
    def of_records(
        cls, records: laspy.ScaleAwarePointRecord, wanted: Sequence[PointField]
    ) -> PointFields | None:
        """Of laspy's records; None if nothing is wanted."""
        if not wanted:
            return None
        return cls(
            **{name: np.array(records[name], dtype) for name, dtype in array_types(wanted).items()}
        )

    @classmethod
    def of_arrays(cls, arrays: Any, wanted: Sequence[PointField]) -> PointFields | None:
        """Of arrays by name, such as those of a stored crop; None if nothing is wanted."""
        names = array_types(wanted)
        return cls(**{name: np.array(arrays[name]) for name in names}) if names else None

    @classmethod
    def joined(cls, parts: Sequence[PointFields | None]) -> PointFields | None:
        """Of points one after another; None if a part is None, or there is none."""
        known = [part for part in parts if part is not None]
        if not known or len(known) < len(parts):
            return None
        names = known[0].arrays()
        return cls(**{name: np.concatenate([getattr(p, name) for p in known]) for name in names})

    @classmethod
    def random(cls, n: int, wanted: Sequence[PointField], rng: np.random.Generator) -> PointFields:
        """Fields of ``n`` points in the whole range that LAS allows."""
        of = rng.integers(1, 16, n).astype(np.uint8)
        made: dict[str, np.ndarray] = {
            "intensity": rng.integers(0, 65536, n).astype(np.uint16),
            "return_number": rng.integers(1, of, endpoint=True).astype(np.uint8),
            "number_of_returns": of,
        }
        return cls(**{name: made[name] for name in array_types(wanted)})


def array_types(wanted: Sequence[PointField]) -> dict[str, type[np.generic]]:
    """Name and type of the arrays of some fields."""
    types = {"intensity": np.uint16}
    return {name: types.get(name, np.uint8) for field in wanted for name in _ARRAYS[field]}


def missing_field(path: str | Path, field: PointField) -> InputError:
    """That a file does not have a field."""
    return InputError(
        f"it has no {TITLES[field]}, which the measurement of the model needs",
        file=path,
        remedy="Use a survey that has them, or a model with measurement presence",
    )


def with_recorded(
    path: str | Path, chunks: Iterable[PointCloud], wanted: Sequence[PointField]
) -> Iterator[PointCloud]:
    """The chunks of a file, of which all fields must be recorded: where a field is not, LAS files
    have 0 in every point.

    Raises:
        InputError: a field is 0 in all points.
    """
    left, n_points = set(wanted), 0
    for chunk in chunks:
        n_points += len(chunk)
        assert chunk.fields is not None
        arrays = chunk.fields.arrays()
        left -= {field for field in left if all(arrays[name].any() for name in _ARRAYS[field])}
        yield chunk
    if n_points and left:
        raise missing_field(path, min(left))
