"""Rules alone, models alone, and both, on voxels and on points (thesis 5.2.4).

Nothing is chosen on the crops that are scored: models, tau and random draws know the training and
validation crops alone, and the fixed answers know none.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from scenenet.core.progress import track
from scenenet.dataset.crops import CropClouds
from scenenet.dataset.folds import folds
from scenenet.dataset.split import crops_in
from scenenet.dataset.voxel_cache import Dataset, load
from scenenet.detection.settings import DetectionSettings
from scenenet.evaluation.answers import Answer, at_or_above_tau, with_rules
from scenenet.experiments.components.settings import ITS_OWN, RULES_ALONE, WITH, WITHOUT
from scenenet.experiments.components.sources import (
    FIXED,
    Known,
    LabelledCrop,
    Source,
    from_file,
    trained,
    untrained,
)
from scenenet.experiments.components.summary import COUNTED, COUNTS, TOWERS, scores_of
from scenenet.experiments.label_noise.settings import LABELS
from scenenet.experiments.run_tables import write_runs
from scenenet.metrics.score_columns import TRUTH
from scenenet.metrics.voxel_scores import Confusion
from scenenet.models.settings import BOOSTED_TREES, ModelSettings


@dataclass(frozen=True)
class Part:
    """Crops to score, and crops that may be learnt from.

    Attributes:
        number: of the fold, from 1; 1 for the test part of a split.
        known: the crops to learn from.
        tested: the crops to score.
    """

    number: int
    known: Known
    tested: list[LabelledCrop]


@dataclass(frozen=True)
class Plan:
    """Which crops are scored.

    Attributes:
        leave_out, neighbour: as for ``scenenet.dataset.folds.folds``; with 0 crops to leave out the
            test part of the split is scored.
        split: CSV file of ``scenenet.dataset.split``.
    """

    leave_out: int
    neighbour: float
    split: str | Path

    def parts(
        self, voxel_manifests: Sequence[str | Path], crop_manifests: Sequence[str | Path]
    ) -> list[Part]:
        """The folds, or the test part of the split.

        Args:
            voxel_manifests, crop_manifests: of the stores of voxels, and of the crops they are of.
        """
        data = load(voxel_manifests)
        clouds = CropClouds(crop_manifests)

        def labelled(rows: Sequence[int]) -> list[LabelledCrop]:
            return [
                LabelledCrop(data.crops[i], clouds[data.crops[i].id], data.samples[i]) for i in rows
            ]

        if self.leave_out:
            return [
                Part(number, Known([data.samples[i] for i in fold.train], []), labelled(fold.out))
                for number, fold in enumerate(
                    folds(data.crops, self.leave_out, self.neighbour), start=1
                )
            ]
        of = {part: _rows(data, self.split, part) for part in ("train", "validation", "test")}
        training, validation = ([data.samples[i] for i in of[p]] for p in ("train", "validation"))
        return [Part(1, Known(training, validation), labelled(of["test"]))]


def _rows(data: Dataset, split: str | Path, part: str) -> list[int]:
    ids = crops_in(split, part)
    return [row for row, sample in enumerate(data.samples) if sample.id in ids]


def score_model(
    parts: Sequence[Part],
    model: ModelSettings | None,
    files: Sequence[str | Path],
    seeds: Sequence[int],
    detection: DetectionSettings,
) -> Iterator[dict[str, Any]]:
    """The rows of a trained model, two for each seed and part: without and with rules.

    Args:
        model: what to train; None for the boosted trees.
        files: the tuned model of each seed, where the workflow has trained it on these parts; empty
            to train here.
        seeds: of the trainings.
    """
    name = BOOSTED_TREES if model is None else model.name
    plans = [(part, n) for n in range(len(seeds)) for part in parts]
    for part, n in track(plans, f"{name}: taken apart"):
        source = from_file(files[n], seeds[n]) if files else trained(model, part.known, seeds[n])
        yield from _of_source(part, source, detection)


def score_untrained(
    parts: Sequence[Part],
    drawn: ModelSettings,
    seeds: Sequence[int],
    detection: DetectionSettings,
) -> Iterator[dict[str, Any]]:
    """The rows of what is not trained: fixed answers, rules alone, published and random parameters.

    Args:
        drawn: the model whose parameters are drawn from each of the ``seeds``.
    """
    for part in track(parts, "without training: taken apart"):
        for name, answer in FIXED.items():
            row = {"model": name, "rules": ITS_OWN, "seed": 0, "parameters": 0}
            scores = _scores(part.tested, [answer(crop) for crop in part.tested])
            if name == LABELS:  # they are all right by themselves
                scores = {k: v if k.startswith(TRUTH) else None for k, v in scores.items()}
            yield _of_part(part) | row | scores
        for source in untrained(drawn, part.known, seeds):
            yield from _of_source(part, source, detection)


def _of_source(
    part: Part, source: Source, detection: DetectionSettings
) -> Iterator[dict[str, Any]]:
    predict, tau = source.predict, source.tau
    answers: dict[str, list[Answer]] = {}
    if source.name != RULES_ALONE:  # without them, every occupied voxel would be tower
        answers[WITHOUT] = [
            at_or_above_tau(crop.cloud, crop.sample, predict, tau) for crop in part.tested
        ]
    answers[WITH] = [
        with_rules(crop.cloud, crop.sample, predict, tau, source.voxel_size, detection)
        for crop in part.tested
    ]
    for rules, given in answers.items():
        row = {
            "model": source.name,
            "rules": rules,
            "seed": source.seed,
            "tau": tau,
            "parameters": source.parameters,
            "training_seconds": source.seconds,
        }
        yield _of_part(part) | row | _scores(part.tested, given)


def _of_part(part: Part) -> dict[str, Any]:
    return {
        "fold": part.number,
        "crops": " ".join(crop.crop.id for crop in part.tested),
        "training_crops": len(part.known.training),
        "tau": None,
        "training_seconds": None,
    }


def _scores(crops: Sequence[LabelledCrop], answers: Sequence[Answer]) -> dict[str, Any]:
    """Counts and scores of answers, against the truth of the crops that have one, and against the
    labels of all."""
    row: dict[str, Any] = {}
    for against in (TRUTH, ""):
        counts = dict.fromkeys(COUNTED, Confusion())
        towers = dict.fromkeys(TOWERS, 0)
        known = looked = False
        for crop, answer in zip(crops, answers, strict=True):
            right = _right(crop, answer, against)
            if right is None:
                continue
            known = True
            points, voxels, places = right
            counts["point"] += points
            counts["voxel"] += Confusion.of(answer.among(len(voxels)), voxels)
            match = answer.match(places)
            if match is not None:
                looked = True
                towers["towers"] += match.n_true
                towers["towers_found"] += len(match.errors)
                towers["towers_false"] += match.n_predicted - len(match.errors)
        row |= scores_of(counts if known else None, against)
        row |= {f"{against}{name}": n if looked else None for name, n in towers.items()}
    return row | {"alive": row["point_tp"] > 0}


def _right(
    crop: LabelledCrop, answer: Answer, against: str
) -> tuple[Confusion, np.ndarray, np.ndarray] | None:
    """The counts of the points of an answer, and what is tower in the crop: voxels (V,) bool, and
    the places of the towers; None where it is not known."""
    if against != TRUTH:
        return answer.points.labels, crop.sample.labels(), crop.crop.towers
    points, true, places = answer.points.truth, crop.sample.truth(), crop.crop.true_towers
    return None if points is None or true is None or places is None else (points, true, places)


COLUMNS = (
    "model", "rules", "seed", "fold", "crops", "training_crops", "alive", "tau",
    *(f"{against}{name}" for against in (TRUTH, "") for name in (*COUNTS, *TOWERS)),
    "parameters",
)  # fmt: skip


def write(rows: Iterator[dict[str, Any]], out: str | Path, out_times: str | Path) -> pd.DataFrame:
    """Write the rows of ``score_model`` or ``score_untrained``.

    Args:
        out: CSV file, columns ``COLUMNS``.
        out_times: CSV file, columns model, seed, fold and training_seconds (s).

    Returns:
        the table of scores.
    """
    return write_runs(list(rows), COLUMNS, ("model", "seed", "fold"), out, out_times)
