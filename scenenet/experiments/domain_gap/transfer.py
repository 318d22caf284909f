"""How well models trained on synthetic crops do on real ones.

    python -m scenenet.experiments.domain_gap.transfer --real FOLDER_OF_TS40K_SAMPLES

trains SCENE-Net and the boosted trees on synthetic crops alone and scores them on real crops. For
comparison, the same models are trained on real crops, two of which are left out at a time. Prints
the table of docs/method/synthetic.md.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd

from scenenet.core.progress import track
from scenenet.dataset.voxels import VoxelGrid, VoxelSample, voxelise
from scenenet.experiments.domain_gap.compare_crops import real_crops, synthetic_crops
from scenenet.experiments.train_and_tune import TunedModel, train_boosted_trees, train_model
from scenenet.metrics.score_columns import score_text
from scenenet.metrics.threshold_curve import ThresholdCurve
from scenenet.metrics.voxel_scores import Confusion
from scenenet.models.settings import BOOSTED_TREES, ModelSettings, TrainingSettings
from scenenet.pointcloud import PointCloud
from scenenet.synthetic import SyntheticSettings

RESOLUTION = 64
VALIDATION = 0.3
"""Share of the synthetic crops on which tau and the seed are chosen."""
LEFT_OUT = 2
"""Number of real crops left out at a time."""

THESIS_MODEL = ModelSettings(
    name="scenenet",
    kind="scenenet",
    protocol="thesis",
    kernel_size=(9, 9, 9),
    training=TrainingSettings(learning_rate=0.01, epochs=150),
)
"""SCENE-Net of the thesis protocol, trained for longer and with larger steps: crops are few."""


def train_scenenet(
    training: Sequence[VoxelSample],
    validation: Sequence[VoxelSample],
    seeds: Sequence[int],
    settings: ModelSettings = THESIS_MODEL,
) -> TunedModel:
    """The best seed on the validation crops, or on the training crops if there are none."""
    tried = [train_model(settings, training, validation, seed) for seed in seeds]
    return max(tried, key=lambda tuned: tuned.f05)


def transfer(
    real: Sequence[VoxelSample], synthetic: Sequence[VoxelSample], seeds: Sequence[int]
) -> pd.DataFrame:
    """Scores on real crops of models trained on synthetic and on real crops.

    Returns:
        a row per model and kind of training crops: model, trained_on, precision, recall, f05,
        iou_tower at the tau chosen without the real test crops, and best_f05: at the best tau.
    """
    order = np.random.default_rng(0).permutation(len(synthetic))
    kept = round(VALIDATION * len(synthetic))
    learnt, validation = ([synthetic[k] for k in part] for part in (order[kept:], order[:kept]))
    rows = []
    jobs = {
        "scenenet": lambda a, b: train_scenenet(a, b, seeds),
        BOOSTED_TREES: train_boosted_trees,
    }
    for name, train in jobs.items():
        model = train(learnt, validation)
        counts, curve = model.score(real), model.curve(real)
        rows.append(_row(name, "synthetic", counts, curve))
        counts, curve = Confusion(), ThresholdCurve.empty()
        for first in track(range(0, len(real), LEFT_OUT), f"{name}: two real crops left out"):
            out = real[first : first + LEFT_OUT]
            others = [*real[:first], *real[first + LEFT_OUT :]]
            model = train(others, [])
            counts += model.score(out)
            curve += model.curve(out)
        rows.append(_row(name, "real, two left out", counts, curve))
    return pd.DataFrame(rows)


def _row(model: str, trained_on: str, counts: Confusion, curve: ThresholdCurve) -> dict:
    scores = counts.scores()
    chosen = {name: scores[name] for name in ("precision", "recall", "f05", "iou_tower")}
    return {"model": model, "trained_on": trained_on, **chosen, "best_f05": curve.best()[1].f05}


def voxelised(crops: Iterable[PointCloud]) -> list[VoxelSample]:
    """Crops on the 64³ grid of the thesis."""
    return [
        voxelise(cloud, VoxelGrid.cube(cloud.xyz, RESOLUTION), f"{number}")
        for number, cloud in enumerate(crops)
    ]


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m scenenet.experiments.domain_gap.transfer",
        description="Train on synthetic crops, score on real crops, compare with training on real.",
    )
    parser.add_argument("--real", required=True, help="folder of TS40K samples")
    parser.add_argument("--towers", type=int, default=60, help="synthetic crops (default 60)")
    parser.add_argument("--seed", type=int, default=0, help="seed of the synthetic corridor")
    parser.add_argument(
        "--seeds", type=int, default=5, help="SCENE-Nets trained on each kind of crops (default 5)"
    )
    arguments = parser.parse_args()
    settings = SyntheticSettings(towers=arguments.towers, seed=arguments.seed)
    table = transfer(
        voxelised(real_crops(arguments.real)),
        voxelised(synthetic_crops(settings)),
        range(arguments.seeds),
    )
    print("| model | trained on | P | R | F0.5 | tower IoU | F0.5 at the best tau |")
    print("|---|---|---|---|---|---|---|")
    for row in table.to_dict("records"):
        numbers = [
            score_text(row[key], 3)
            for key in ("precision", "recall", "f05", "iou_tower", "best_f05")
        ]
        print(f"| {row['model']} | {row['trained_on']} | {' | '.join(numbers)} |")


if __name__ == "__main__":
    main()
