"""Training on noisy labels, with scores against labels of the same quality and against the truth.

"SCENE-Net is able to recover the body of the tower without detecting ground and power line patches
that are mislabeled as tower" (thesis 5.2.5). In the data of the thesis it is not known which labels
are wrong; on a synthetic line it is known, and their share can be chosen.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from scenenet.core.progress import track
from scenenet.dataset.voxels import VoxelSample, VoxelSettings
from scenenet.experiments.label_noise.corridor import NoisyLine, noisy_lines
from scenenet.experiments.label_noise.settings import AGAINST, LABELS, LabelNoiseSettings
from scenenet.experiments.run_tables import write_runs
from scenenet.experiments.train_and_tune import TunedModel, train_and_tune
from scenenet.metrics.score_columns import TOWER_ONLY_SCORES
from scenenet.metrics.voxel_scores import Confusion
from scenenet.models.settings import BOOSTED_TREES, ModelSettings

COLUMNS = (
    "level", "share", "strength", "seed", "model", "alive", "tau",
    *(f"{against}_{score}" for against in AGAINST for score in TOWER_ONLY_SCORES),
    "wrong_detected", "validation_f05", "training_crops", "test_crops", "parameters",
)  # fmt: skip


@dataclass
class Tally:
    """Counts of detected voxels, summed over crops.

    Attributes:
        labels, truth: counts of voxels against the labels and against the truth.
        wrong, wrong_detected: voxels labelled tower that contain no tower point, and how many of
            them are detected.
    """

    labels: Confusion = field(default_factory=Confusion)
    truth: Confusion = field(default_factory=Confusion)
    wrong: int = 0
    wrong_detected: int = 0

    def add(self, detected: np.ndarray, labelled: VoxelSample, true: VoxelSample) -> None:
        """Count a crop; ``detected`` (V,) bool is for every voxel of its grid."""
        labels, truth = _towers(labelled), _towers(true)
        self.labels += Confusion.of(detected, labels)
        self.truth += Confusion.of(detected, truth)
        wrong = labels & ~truth
        self.wrong += int(wrong.sum())
        self.wrong_detected += int((wrong & detected).sum())

    def row(self) -> dict[str, Any]:
        """Columns of ``COLUMNS`` that follow from the counts."""
        scores = {
            f"{against}_{name}": value
            for against in AGAINST
            for name, value in getattr(self, against).scores().items()
            if name in TOWER_ONLY_SCORES
        }
        share = self.wrong_detected / self.wrong if self.wrong else float("nan")
        return scores | {"alive": self.truth.tp > 0, "wrong_detected": share}


def train_with_label_noise(
    settings: LabelNoiseSettings,
    models: Sequence[ModelSettings],
    voxels: VoxelSettings,
    seed: int,
    out: str | Path,
    out_times: str | Path,
) -> pd.DataFrame:
    """Train every model from one seed at every level of noise, and write a row for each.

    The labels for training and for the choice of tau are noisy; a model never sees the truth. At
    each level a row named ``LABELS`` has the scores of the labels themselves.

    Args:
        settings: levels, line, and numbers of towers to train and tune on.
        models: the models that take part in addition to the boosted trees.
        voxels: grid of the crops.
        seed: of the line and of every training.
        out: CSV file, columns ``COLUMNS``.
        out_times: CSV file, columns level, seed, model and training_seconds (s).

    Returns:
        the table of scores.

    Raises:
        InputError: a level cannot be reached, or no training crop has a tower.
    """
    lines = noisy_lines(settings.line_of(seed), settings.levels, voxels)
    rows = list(_rows(lines, settings, models, seed))
    return write_runs(rows, COLUMNS, ("level", "seed", "model"), out, out_times)


def _rows(
    lines: Sequence[NoisyLine],
    study: LabelNoiseSettings,
    models: Sequence[ModelSettings],
    seed: int,
) -> Iterator[dict[str, Any]]:
    """One tower after the training part and one after the validation part are left out, so that no
    crop has a neighbour in another part."""
    tuned_from = study.training + 1
    tested_from = tuned_from + study.validation + 1
    plans = [(line, settings) for line in lines for settings in [*models, None]]
    for number, (line, settings) in enumerate(track(plans, f"label noise, seed {seed}: trainings")):
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
        tuned = train_and_tune(
            settings, training, line.labelled[tuned_from : tested_from - 1], seed
        )

        def detect(sample: VoxelSample, tuned: TunedModel = tuned) -> np.ndarray:
            return tuned.predict(sample)[0] >= tuned.tau

        yield (
            facts
            | _tallied(detect, tests)
            | {
                "model": BOOSTED_TREES if settings is None else settings.name,
                "tau": tuned.tau,
                "validation_f05": tuned.f05,
                "training_crops": len(training),
                "parameters": tuned.parameters,
                "training_seconds": tuned.seconds,
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
    """(V,) bool: voxels of a sample that are labelled tower."""
    return sample.spread(sample.labelled)[1]
