"""The observer of a target beside boosted trees and a CNN that learn from the same crops.

    python -m scenenet.experiments.observers --target wire --train FOLDER --test FILE...

trains each of them on the TS40K samples of FOLDER and scores them on whole surveys that none of
them has seen, by points: a point is found if the probability of its voxel reaches tau. Prints the
table of docs/method/observers.md.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scenenet.core.progress import track
from scenenet.dataset.voxels import VoxelGrid, VoxelSample, voxelise
from scenenet.evaluation.points import PointCounts
from scenenet.experiments.train_and_tune import TunedModel, train_boosted_trees, train_model
from scenenet.models.settings import BOOSTED_TREES
from scenenet.pointcloud import PointCloud
from scenenet.pointcloud.class_schemes import SCHEMES
from scenenet.pointcloud.reading import read
from scenenet.pointcloud.targets import Target
from scenenet.pointcloud.ts40k import sample_files
from scenenet.training import presets

DEFAULT_VOXEL = 0.5
"""m, voxel size of all models where the target has none of its own."""
FIRST_SEED = 0


@dataclass(frozen=True)
class Contender:
    """A trained model.

    Attributes:
        name: in the table.
        model: at its tau.
    """

    name: str
    model: TunedModel


def voxel_size_of(target: Target) -> float:
    """m, voxel size of all models of a target."""
    return presets.voxel_size("scenenet", "operational", target) or DEFAULT_VOXEL


def contenders(target: Target, training: Sequence[VoxelSample], seed: int) -> Iterator[Contender]:
    """The observer, the boosted trees and an informed CNN, all trained on the same crops."""
    for kind, name in (("scenenet", "observer"), ("cnn", "CNN")):
        settings = presets.preset(kind, "operational", target=target)
        yield Contender(name, train_model(settings, training, [], seed))
    yield Contender(BOOSTED_TREES, train_boosted_trees(training, [], seed))


def found_points(
    contender: Contender, cloud: PointCloud, sample: VoxelSample, target: Target
) -> PointCounts:
    """Points of a survey in voxels whose probability reaches tau, against its labels."""
    probability, _ = contender.model.predict(sample)
    taken = probability[sample.grid.voxel_of(cloud.xyz)] >= contender.model.tau
    return PointCounts.of(cloud, taken, target)


def table(
    target: Target, train: str | Path, train_codes: str, tests: Sequence[Path], codes: str
) -> list[str]:
    """Lines of a Markdown table: a row for each survey, and the median.

    Raises:
        InputError: a file cannot be used, or no crop has the target.
    """
    size = voxel_size_of(target)
    training = []
    for path in track(sample_files(train), "crops"):
        cloud = read(path, train_codes)
        grid = VoxelGrid.metric(cloud.xyz, size)
        training.append(voxelise(cloud, grid, path.stem, target))
    trained = list(contenders(target, training, FIRST_SEED))
    head = " | ".join(f"{c.name}: precision, recall | IoU" for c in trained)
    lines = [f"| survey | {head} |", "|---" * (1 + 2 * len(trained)) + "|"]
    ious = []
    for path in track(tests, "surveys"):
        cloud = read(path, codes)
        sample = voxelise(cloud, VoxelGrid.metric(cloud.xyz, size), path.stem, target)
        counts = [found_points(c, cloud, sample, target).labels.scores() for c in trained]
        ious.append([scores["iou_tower"] for scores in counts])
        cells = [f"{s['precision']:.2f}, {s['recall']:.2f} | {s['iou_tower']:.2f}" for s in counts]
        lines.append(f"| {path.stem} | {' | '.join(cells)} |")
    middle = [f" | {value:.2f}" for value in np.median(np.array(ious), axis=0)]
    return [*lines, f"| median | {' | '.join(middle)} |"]


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m scenenet.experiments.observers",
        description="Train an observer, boosted trees and a CNN on crops, and score them on "
        "surveys, by points.",
    )
    parser.add_argument("--target", default="wire", help="what to find (default wire)")
    parser.add_argument("--train", required=True, help="folder of TS40K samples")
    parser.add_argument("--train-codes", default="edp", choices=SCHEMES, help="(default edp)")
    parser.add_argument("--test", required=True, nargs="+", type=Path, help="labelled surveys")
    parser.add_argument("--codes", default="asprs", choices=SCHEMES, help="(default asprs)")
    arguments = parser.parse_args()
    target = Target.parse(arguments.target)
    print(
        "\n".join(
            table(target, arguments.train, arguments.train_codes, arguments.test, arguments.codes)
        )
    )


if __name__ == "__main__":
    main()
