"""What a tuning found, as a type and as the JSON files under ``results/tune``. Without torch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from scenenet.metrics.voxel_scores import VoxelScores

Size = tuple[int, int, int]


@dataclass(frozen=True)
class TriedSize:
    """The best threshold of one kernel size.

    Attributes:
        kernel_size: (kz, ky, kx), voxels.
        scores: on the validation crops at the threshold that is best for this size.
    """

    kernel_size: Size
    scores: VoxelScores

    def to_json(self) -> dict[str, Any]:
        scores = asdict(self.scores)
        del scores["n_samples"]  # that of the tuning
        return {"kernel_size": list(self.kernel_size), "tau": scores.pop("tau"), **scores}


@dataclass(frozen=True)
class Tuning:
    """The choice of tau and kernel size for one trained model.

    Attributes:
        model: name of the model.
        kernel_size: the chosen one, (kz, ky, kx), voxels.
        validation: scores on the validation crops at the chosen tau.
        curve: precision, recall and f05 at every tau, and tau (``curve_columns``).
        kernel_sizes: all sizes that were tried, that of the training first.
        whole_towers: scores of the voxels of whole towers on the validation crops, found at the
            chosen tau; None for a model that gives voxels at or above tau.
    """

    model: str
    kernel_size: Size
    validation: VoxelScores
    curve: Mapping[str, Sequence[float | None]]
    kernel_sizes: tuple[TriedSize, ...]
    whole_towers: VoxelScores | None = None

    @property
    def decisive(self) -> tuple[float, float]:
        """What the seed is chosen by: F0.5 of the answer that users get, then that of the voxels at
        or above tau."""
        observer = self.validation.decisive
        return observer if self.whole_towers is None else self.whole_towers.decisive, observer

    @property
    def tau(self) -> float:
        """The chosen threshold."""
        return self.validation.tau

    def to_json(self) -> dict[str, Any]:
        """The content of the file."""
        return {
            "model": self.model,
            "tau": self.tau,
            "kernel_size": list(self.kernel_size),
            "validation": asdict(self.validation),
            "curve": dict(self.curve),
            "kernel_sizes": [tried.to_json() for tried in self.kernel_sizes],
            "whole_towers": None if self.whole_towers is None else asdict(self.whole_towers),
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Tuning:
        """The tuning from the result of ``to_json``.

        Raises:
            KeyError, TypeError: a score is missing or unknown.
        """
        validation = VoxelScores(**data["validation"])
        tried = []
        for row in data["kernel_sizes"]:
            size, scores = tuple(row["kernel_size"]), {**row, "n_samples": validation.n_samples}
            del scores["kernel_size"]
            tried.append(TriedSize(size, VoxelScores(**scores)))
        size = tuple(data["kernel_size"])
        whole = data["whole_towers"]
        towers = None if whole is None else VoxelScores(**whole)
        return cls(data["model"], size, validation, data["curve"], tuple(tried), towers)
