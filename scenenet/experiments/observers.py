"""The observer of a target beside boosted trees and a CNN that learn from the same crops.

    python -m scenenet.experiments.observers --target wire --train FOLDER --test FILE...

trains each of them on the TS40K samples or the surveys that are named, and scores them on whole
surveys that none of them has seen, by points: a point is found if the probability of its voxel
reaches tau. Prints a table of docs/method/observers.md.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scenenet.core.progress import track
from scenenet.core.scratch import scratch_folder
from scenenet.dataset.square_settings import SquareSettings
from scenenet.dataset.squares import cut_squares
from scenenet.dataset.voxel_cache import build, load
from scenenet.dataset.voxels import VoxelGrid, VoxelSample, VoxelSettings, voxelise
from scenenet.evaluation.points import PointCounts
from scenenet.experiments.train_and_tune import TunedModel, train_boosted_trees, train_model
from scenenet.models.settings import BOOSTED_TREES
from scenenet.pointcloud import PointCloud
from scenenet.pointcloud.class_schemes import SCHEMES
from scenenet.pointcloud.reading import read
from scenenet.pointcloud.targets import Target
from scenenet.training import presets

DEFAULT_VOXEL = 0.5
"""m, voxel size of all models where the target has none of its own."""


@dataclass(frozen=True)
class Contender:
    """A model, trained once for each seed.

    Attributes:
        name: in the table.
        models: at their tau.
    """

    name: str
    models: tuple[TunedModel, ...]


@dataclass(frozen=True)
class Labelled:
    """Files with labels.

    Attributes:
        paths: surveys, TS40K samples, or, to train on, folders of samples.
        codes: their class scheme.
        target: what is looked for, in this scheme.
    """

    paths: Sequence[Path]
    codes: str
    target: Target


def voxel_size_of(target: Target) -> float:
    """m, voxel size of all models of a target."""
    return presets.voxel_size("scenenet", "operational", target) or DEFAULT_VOXEL


def crops_of(files: Labelled, size: float) -> list[VoxelSample]:
    """The crops of files as ``scenenet train`` cuts them, in voxels of ``size`` m.

    Raises:
        InputError: a file cannot be used, or no crop has the target.
    """
    manifests = []
    with scratch_folder() as scratch:
        for number, path in enumerate(files.paths):
            folder = scratch / f"{number}"
            folder.mkdir()
            crops, voxels = folder / "crops.json", folder / "voxels.json"
            how = files.target, SquareSettings(), folder / "crops.zarr.zip", crops
            cut_squares(f"{number}", path, files.codes, *how)
            grid = VoxelSettings(fit="metric", voxel_size=size)
            build(crops, grid, folder / "voxels.zarr.zip", voxels, shapes=False)
            manifests.append(voxels)
        return load(manifests).samples


def contenders(
    target: Target, training: Sequence[VoxelSample], seeds: Sequence[int]
) -> Iterator[Contender]:
    """The observer, an informed CNN and the boosted trees, all trained on the same crops."""
    for kind, name in (("scenenet", "observer"), ("cnn", "CNN")):
        settings = presets.preset(kind, "operational", target=target)
        yield Contender(name, tuple(train_model(settings, training, [], seed) for seed in seeds))
    grown = tuple(train_boosted_trees(training, [], seed) for seed in seeds)
    yield Contender(BOOSTED_TREES, grown)


def found_points(
    model: TunedModel, cloud: PointCloud, sample: VoxelSample, target: Target
) -> PointCounts:
    """Points of a survey in voxels whose probability reaches tau, against its labels."""
    probability, _ = model.predict(sample)
    taken = probability[sample.grid.voxel_of(cloud.xyz)] >= model.tau
    return PointCounts.of(cloud, taken, target)


def table(train: Labelled, tests: Sequence[Labelled], seeds: Sequence[int] = (0,)) -> list[str]:
    """Lines of a Markdown table: a row for each survey, and the median of those with the target.

    Each contender has the mean over its seeds, and the lowest and the highest IoU. The last column
    is the trivial answer, that every point is the target.

    Raises:
        InputError: a file cannot be used, or no crop has the target.
    """
    size = voxel_size_of(train.target)
    trained = list(contenders(train.target, crops_of(train, size), seeds))
    head = " | ".join(f"{c.name}: precision, recall | IoU" for c in trained)
    lines = [f"| survey | {head} | every point: IoU |", "|---" * (2 + 2 * len(trained)) + "|"]
    ious = []
    for files in tests:
        for path in track(files.paths, "surveys"):
            cloud = read(path, files.codes)
            grid = VoxelGrid.metric(cloud.xyz, size)
            sample = voxelise(cloud, grid, path.stem, files.target)
            share = float(cloud.is_labelled(files.target).mean())
            cells, means = [], []
            for contender in trained:
                counts = [found_points(m, cloud, sample, files.target) for m in contender.models]
                text, mean = _cells(counts, share > 0)
                cells.append(text)
                means.append(mean)
            if share > 0:
                ious.append([*means, share])
            lines.append(f"| {path.stem} | {' | '.join(cells)} | {share:.2f} |")
    middle = np.median(np.array(ious), axis=0)
    cells = [f" | {value:.2f}" for value in middle[:-1]]
    return [*lines, f"| median | {' | '.join(cells)} | {middle[-1]:.2f} |"]


def _cells(counts: Sequence[PointCounts], there: bool) -> tuple[str, float]:
    """The two cells of a contender in a survey, and its mean IoU.

    Args:
        counts: of each seed.
        there: whether the survey has the target.
    """
    scores = [each.labels.scores() for each in counts]
    precision, recall, ious = (
        [float(score[name] or 0) for score in scores]
        for name in ("precision", "recall", "iou_tower")
    )
    if not there:
        taken = [each.labels.fp / (each.labels.fp + each.labels.tn) for each in counts]
        return f"none there | {np.mean(taken):.1%} taken", 0.0
    mean = float(np.mean(ious))
    spread = "" if len(counts) == 1 else f" ({min(ious):.2f} to {max(ious):.2f})"
    return f"{np.mean(precision):.2f}, {np.mean(recall):.2f} | {mean:.2f}{spread}", mean


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m scenenet.experiments.observers",
        description="Train an observer, boosted trees and a CNN on crops, and score them on "
        "surveys, by points.",
    )
    parser.add_argument("--target", default="wire", help="what to find (default wire)")
    parser.add_argument(
        "--train", required=True, nargs="+", type=Path, help="TS40K samples, folders, or surveys"
    )
    parser.add_argument("--train-codes", default="edp", choices=SCHEMES, help="(default edp)")
    parser.add_argument("--test", default=[], nargs="+", type=Path, help="labelled surveys")
    parser.add_argument("--codes", default="asprs", choices=SCHEMES, help="(default asprs)")
    parser.add_argument(
        "--test-target", help="the same target with its codes there (default: as --target)"
    )
    parser.add_argument(
        "--like", default=[], nargs="+", type=Path, help="further surveys, labelled as --train"
    )
    parser.add_argument("--seeds", default=1, type=int, help="trainings of each (default 1)")
    given = parser.parse_args()
    target = Target.parse(given.target)
    there = Target.parse(given.test_target or given.target)
    tests = [
        Labelled(given.like, given.train_codes, target),
        Labelled(given.test, given.codes, there),
    ]
    train = Labelled(given.train, given.train_codes, target)
    print("\n".join(table(train, tests, range(given.seeds))))


if __name__ == "__main__":
    main()
