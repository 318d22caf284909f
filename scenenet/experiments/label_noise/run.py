"""Training on labels that are wrong, and scores against these labels and against the truth.

"SCENE-Net is able to recover the body of the tower without detecting ground and power line patches
that are mislabeled as tower" (thesis 5.2.5). There nobody knows which labels are wrong; on a
synthetic line it is known, and how many are can be chosen.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scenenet.core.files import atomic
from scenenet.core.progress import track
from scenenet.dataset.voxels import VoxelSample, VoxelSettings
from scenenet.experiments.label_noise.corridor import NoisyLine, noisy_lines
from scenenet.experiments.label_noise.settings import AGAINST, LABELS, SCORES, NoiseSettings
from scenenet.experiments.train_and_tune import TunedModel, train_and_tune
from scenenet.metrics.voxel_scores import Confusion
from scenenet.models.settings import BOOSTED_TREES, ModelSettings

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = (
    "level", "share", "strength", "seed", "model", "alive", "tau",
    *(f"{against}_{score}" for against in AGAINST for score in SCORES),
    "wrong_detected", "validation_f05", "training_crops", "test_crops", "parameters",
    "training_seconds",
)  # fmt: skip


@dataclass
class Tally:
    """What a model detects, added up over crops.

    Attributes:
        labels, truth: counts of voxels against the labels and against the truth.
        wrong, wrong_detected: voxels labelled tower without a point of one, and those of them that
            are detected.
    """

    labels: Confusion = field(default_factory=Confusion)
    truth: Confusion = field(default_factory=Confusion)
    wrong: int = 0
    wrong_detected: int = 0

    def add(self, detected: np.ndarray, labelled: VoxelSample, true: VoxelSample) -> None:
        """Count a crop, from (V,) bool of every voxel of its grid."""
        told, right = _towers(labelled), _towers(true)
        self.labels += _compared(detected, told)
        self.truth += _compared(detected, right)
        wrong = told & ~right
        self.wrong += int(wrong.sum())
        self.wrong_detected += int((wrong & detected).sum())

    def row(self) -> dict[str, Any]:
        scores = {
            f"{against}_{name}": float(getattr(getattr(self, against), name))
            for against in AGAINST
            for name in SCORES
        }
        share = self.wrong_detected / self.wrong if self.wrong else float("nan")
        return scores | {"alive": self.truth.tp > 0, "wrong_detected": share}


def run_noise(
    study: NoiseSettings,
    models: Sequence[ModelSettings],
    voxels: VoxelSettings,
    seed: int,
    out: str | Path,
) -> pd.DataFrame:
    """Train every model from one seed at every level of noise, and write a row for each.

    Labels of training and of choosing tau have the noise; a model never sees the truth. A row of
    ``LABELS`` says at each level how good the labels are.

    Args:
        models: those that take part beside the boosted trees.
        out: CSV file, columns ``COLUMNS``.

    Returns:
        what was written.

    Raises:
        InputError: a level cannot be reached, or there is nothing to learn from.
    """
    import pandas as pd

    lines = noisy_lines(study.line_of(seed), study.levels, voxels)
    rows = list(_rows(lines, study, models, seed))
    table = pd.DataFrame(rows)[list(COLUMNS)]
    with atomic(out) as partial:
        table.to_csv(partial, index=False, float_format="%.6g")
    return table


def _rows(
    lines: Sequence[NoisyLine], study: NoiseSettings, models: Sequence[ModelSettings], seed: int
) -> Iterator[dict[str, Any]]:
    """One tower behind the training part and one behind the validation part are left out, so that
    no crop has a neighbour in another part."""
    tuned_from = study.training + 1
    tested_from = tuned_from + study.validation + 1
    plans = [(line, settings) for line in lines for settings in [*models, None]]
    for number, (line, settings) in enumerate(track(plans, f"noise, seed {seed}: trainings")):
        tests = list(zip(line.labelled[tested_from:], line.true[tested_from:], strict=True))
        facts = {
            "level": line.level,
            "share": line.share,
            "strength": line.strength,
            "seed": seed,
            "test_crops": len(tests),
        }
        if number % (len(models) + 1) == 0:
            yield dict.fromkeys(COLUMNS) | facts | {"model": LABELS} | _tallied(_towers, tests)
        training = line.labelled[: study.training]
        rival = train_and_tune(
            settings, training, line.labelled[tuned_from : tested_from - 1], seed
        )

        def detect(sample: VoxelSample, rival: TunedModel = rival) -> np.ndarray:
            return rival.answer(sample)[0] >= rival.tau

        yield (
            facts
            | _tallied(detect, tests)
            | {
                "model": BOOSTED_TREES if settings is None else settings.name,
                "tau": rival.tau,
                "validation_f05": rival.f05,
                "training_crops": len(training),
                "parameters": rival.parameters,
                "training_seconds": rival.seconds,
            }
        )


def _tallied(
    detect: Callable[[VoxelSample], np.ndarray], tests: Sequence[tuple[VoxelSample, VoxelSample]]
) -> dict[str, Any]:
    tally = Tally()
    for labelled, true in tests:
        tally.add(detect(labelled), labelled, true)
    return tally.row()


def _towers(sample: VoxelSample) -> np.ndarray:
    """(V,) bool, the towers of a sample."""
    return sample.spread(sample.tower)[1]


def _compared(detected: np.ndarray, tower: np.ndarray) -> Confusion:
    tp, n_detected, n_tower = (int(each.sum()) for each in (detected & tower, detected, tower))
    fp, fn = n_detected - tp, n_tower - tp
    return Confusion(tp, fp, fn, tower.size - tp - fp - fn)
