"""One trained, tuned and evaluated model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from scenenet.evaluation.result import Evaluation
from scenenet.metrics.voxel_scores import VoxelScores
from scenenet.training.tuning_result import Tuning

HISTORY_MEASURES = frozenset({"epoch", "loss", "fidelity", "penalty", "seconds", "learning_rate"})
"""Columns of a training history that are not parameters of the model."""


@dataclass(frozen=True)
class SeedResult:
    """One model trained from one seed, tuned and evaluated.

    Attributes:
        model: name of the model in the configuration.
        kind: architecture: ``scenenet``, ``cnn`` or ``BOOSTED_TREES``.
        seed: the seed it was trained from.
        evaluation: scores on the test crops (``evaluate/MODEL/seed-N.json``).
        tuning: tau and the scores on the validation crops; None before tuning.
        history: one row per epoch; None if the model was not trained here.
        provenance: record of settings, inputs and code of the training.
        resources: memory and time of the training (``scenenet.core.peak_memory.used``).
        model_files: files of the tuned model.
    """

    model: str
    kind: str
    seed: int
    evaluation: Evaluation
    tuning: Tuning | None = None
    history: pd.DataFrame | None = None
    provenance: Mapping[str, Any] | None = None
    resources: Mapping[str, Any] | None = None
    model_files: tuple[Path, ...] = ()

    @property
    def alive(self) -> bool:
        """Whether the model is live: it detects a tower voxel (thesis 5.2.6: one CNN in five
        is)."""
        return self.evaluation.alive

    @property
    def validation(self) -> VoxelScores | None:
        """Scores on the validation crops at tau; None before tuning."""
        return None if self.tuning is None else self.tuning.validation

    @property
    def decisive(self) -> tuple[float, float]:
        """What to choose by on the validation crops (``Tuning.decisive``); 0 before tuning."""
        return (0.0, 0.0) if self.tuning is None else self.tuning.decisive

    @property
    def epochs(self) -> int | None:
        """Epochs it was trained for."""
        return None if self.history is None else len(self.history)

    @property
    def seconds(self) -> float | None:
        """Training time, s."""
        if self.history is None or "seconds" not in self.history:
            return None
        return float(self.history["seconds"].sum())


def parameter_columns(history: pd.DataFrame) -> list[str]:
    """Columns of a training history with parameters of the model, such as ``cylinder.r``."""
    return [
        name
        for name in history.columns
        if name not in HISTORY_MEASURES and not name.startswith(("train_", "validation_"))
    ]
