"""Every crop is a test crop once: what a split of a handful of crops cannot tell.

tau is chosen on the training crops of the fold, and nothing is chosen on those left out
(docs/method/accuracy.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scenenet.core.files import atomic
from scenenet.core.progress import track
from scenenet.dataset.folds import folds
from scenenet.dataset.voxel_cache import Dataset, load
from scenenet.detection.settings import DetectionSettings
from scenenet.experiments.train_and_tune import train_and_tune
from scenenet.models.settings import BOOSTED_TREES, ModelSettings

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = (
    "model", "seed", "fold", "crops", "training_crops", "alive", "tau", "precision", "recall",
    "f05", "iou_tower", "miou", "tp", "fp", "fn", "tn", "training_f05", "parameters",
    "training_seconds",
)  # fmt: skip

WHOLE_TOWERS = ", whole towers"
"""Behind the name of a model: its voxels are those of the towers that are found with it."""


def cross_validate(
    voxel_manifests: Sequence[str | Path],
    model: ModelSettings | None,
    seeds: Sequence[int],
    leave_out: int,
    neighbour: float,
    detection: DetectionSettings,
    out: str | Path,
) -> pd.DataFrame:
    """Train one model from every seed on every fold, score it on the crops left out, and write two
    rows for each: of the voxels that reach tau, and of those of whole towers.

    Args:
        voxel_manifests: of the voxel stores.
        model: what is trained; None for the boosted trees.
        leave_out, neighbour: as ``scenenet.dataset.folds``.
        detection: what makes a tower; the same for every model.
        out: CSV file, columns ``COLUMNS``; ``training_f05`` is on the crops that tau was chosen on.

    Returns:
        what was written.

    Raises:
        InputError: there are too few crops, or none with a tower to learn from.
    """
    import pandas as pd

    table = pd.DataFrame(
        run_folds(load(voxel_manifests), model, seeds, leave_out, neighbour, detection)
    )
    with atomic(out) as partial:
        table[list(COLUMNS)].to_csv(partial, index=False, float_format="%.6g")
    return table[list(COLUMNS)]


def run_folds(
    dataset: Dataset,
    model: ModelSettings | None,
    seeds: Sequence[int],
    leave_out: int,
    neighbour: float,
    detection: DetectionSettings,
) -> list[dict[str, Any]]:
    """The rows of ``cross_validate``."""
    name = BOOSTED_TREES if model is None else model.name
    parts = folds(dataset.crops, leave_out, neighbour)
    plans = [(seed, number, fold) for seed in seeds for number, fold in enumerate(parts, start=1)]
    rows = []
    for seed, number, fold in track(plans, f"{name}: folds"):
        training = [dataset.samples[i] for i in fold.learnt]
        left_out = [dataset.samples[i] for i in fold.out]
        rival = train_and_tune(model, training, [], seed)
        shared = {
            "seed": seed,
            "fold": number,
            "crops": " ".join(sample.id for sample in left_out),
            "training_crops": len(training),
            "tau": rival.tau,
            "training_f05": rival.f05,
            "parameters": rival.parameters,
            "training_seconds": rival.seconds,
        }
        reached, whole = rival.score(left_out), rival.score_towers(left_out, detection)
        for called, counts in ((name, reached), (name + WHOLE_TOWERS, whole)):
            cells = {part: getattr(counts, part) for part in ("tp", "fp", "fn", "tn")}
            alive = {"alive": counts.tp > 0}
            rows.append({"model": called, **shared, **alive, **counts.scores(), **cells})
    return rows
