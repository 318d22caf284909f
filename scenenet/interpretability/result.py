"""The certificate of a model, as types and as the JSON files under ``results/certificate``.

It imports neither torch nor the models, so that tables and the report do not depend on them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class Turn:
    """Outputs for a scene and for the same scene moved, compared at the same points.

    Attributes:
        degrees: rotation about z; None for the shift by half a voxel.
        mean_h: mean |difference| of H, as a share of the standard deviation of H.
        mean_m: mean |difference| of M, in [0, 1].
        largest_m: the largest |difference| of M.
        decision_changed: of the points at or above tau before or after, the share that is so only
            once; None without tau, or without such points.
    """

    degrees: float | None
    mean_h: float
    mean_m: float
    largest_m: float
    decision_changed: float | None


@dataclass(frozen=True)
class Statement:
    """A property of a GENEO and whether a model has it.

    Attributes:
        property: the property.
        thesis: where the thesis claims it.
        holds: whether the model has it.
        text: the finding in words.
        value: number that supports it; None if there is none.
    """

    property: str
    thesis: str
    holds: bool
    text: str
    value: float | None = None


@dataclass(frozen=True)
class ModelCertificate:
    """The certificate of a model file.

    Attributes:
        model, seed, kind: name, seed and architecture of the model.
        voxel_size: m, at which it was measured.
        scene: describes the scene of the measurement.
        half_voxel: differences after a shift by half a voxel along x and y.
        turns: differences after rotations about z.
        statements: the properties that were verified.
        numbers: the other attributes of ``scenenet.interpretability.geneo_properties.Certificate``,
            by name, plain.
    """

    model: str
    seed: int | None
    kind: str
    voxel_size: float
    scene: str
    half_voxel: Turn
    turns: tuple[Turn, ...]
    statements: tuple[Statement, ...]
    numbers: Mapping[str, Any]

    def to_json(self) -> dict[str, Any]:
        """Plain values; ``numbers`` are merged with the other attributes."""
        values = asdict(self)
        numbers = values.pop("numbers")
        lists = {name: list(values.pop(name)) for name in ("turns", "statements")}
        return values | numbers | lists

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> ModelCertificate:
        """The certificate from the result of ``to_json``.

        Raises:
            KeyError, TypeError: a value is missing or unknown.
        """
        plain = {name: data[name] for name in ("model", "seed", "kind", "voxel_size", "scene")}
        typed = {
            "half_voxel": Turn(**data["half_voxel"]),
            "turns": tuple(Turn(**turn) for turn in data["turns"]),
            "statements": tuple(Statement(**statement) for statement in data["statements"]),
        }
        known = plain | typed
        return cls(**known, numbers={n: value for n, value in data.items() if n not in known})
