"""Synthetic crops compared with real ones, by property and by a classifier that separates them.

    python -m scenenet.experiments.domain_gap.compare_crops --real FOLDER --towers 100

prints the tables of docs/method/synthetic.md; FOLDER has TS40K samples. Synthetic crops are made by
the same stages as the crops of a survey: LAZ file, towers, crops.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from scenenet.baselines.quantile_bins import QuantileBins
from scenenet.baselines.voxel_features import FEATURES, voxel_features
from scenenet.core.errors import InputError
from scenenet.core.scratch import scratch_folder
from scenenet.dataset.crops import CropSettings, cut_crops, read_crops
from scenenet.dataset.labelled_towers import TowerSettings, survey_towers
from scenenet.dataset.voxels import VoxelGrid, voxelise
from scenenet.experiments.domain_gap.crop_statistics import (
    PROPERTIES,
    crop_statistics,
    voxel_statistics,
)
from scenenet.pointcloud import PointCloud, read
from scenenet.pointcloud.ts40k import sample_files
from scenenet.synthetic import SyntheticSettings, make_survey

if TYPE_CHECKING:
    from sklearn.ensemble import HistGradientBoostingClassifier

RESOLUTION = 64
VOXELS = 1500
"""Number of occupied voxels per crop for the classifier of voxels."""
FOLDS = 6
REPEATS, VOXEL_REPEATS = 10, 3
"""Repetitions of the cross-validation of crops and of voxels, each with different folds."""


def synthetic_crops(settings: SyntheticSettings) -> Iterator[PointCloud]:
    """The crops of a synthetic survey, made by the stages for any survey."""
    with scratch_folder() as folder:
        survey, manifest = folder / "survey.laz", folder / "crops.json"
        make_survey(settings, survey)
        towers = survey_towers(survey, "edp", TowerSettings()).towers
        cut_crops(
            "synthetic", survey, "edp", towers, CropSettings(), folder / "crops.zarr.zip", manifest
        )
        for _, cloud in read_crops(manifest):
            yield cloud


def real_crops(folder: str | Path) -> Iterator[PointCloud]:
    """The TS40K samples of a folder.

    Raises:
        InputError: the folder has no samples.
    """
    samples = sample_files(folder)
    if not samples:
        raise InputError(
            "there are no TS40K samples", file=folder, remedy="Name a folder of .npy or .pt samples"
        )
    for sample in samples:
        yield read(sample, "edp")


@dataclass(frozen=True)
class Measured:
    """Measurements of a set of crops.

    Attributes:
        properties: ``crop_statistics``, a row per crop.
        grids: ``voxel_statistics``, a row per crop.
        voxels: (V, F) ``voxel_features`` of some occupied voxels.
        crop: (V,) number of the crop of each voxel.
    """

    properties: pd.DataFrame
    grids: pd.DataFrame
    voxels: np.ndarray
    crop: np.ndarray


def measure(crops: Iterable[PointCloud]) -> Measured:
    """Measure crops."""
    properties, grids, voxels, owner = [], [], [], []
    rng = np.random.default_rng(0)
    for number, cloud in enumerate(crops):
        sample = voxelise(cloud, VoxelGrid.cube(cloud.xyz, RESOLUTION))
        features = voxel_features(sample)
        some = rng.choice(len(features), min(VOXELS, len(features)), replace=False)
        properties.append(crop_statistics(cloud))
        grids.append(voxel_statistics(sample))
        voxels.append(features[some])
        owner.append(np.full(len(some), number))
    return Measured(
        pd.DataFrame(properties),
        pd.DataFrame(grids),
        np.concatenate(voxels),
        np.concatenate(owner),
    )


def compare_properties(real: pd.DataFrame, synthetic: pd.DataFrame) -> pd.DataFrame:
    """Compare each property of real and synthetic crops.

    Returns:
        a row per property: unit, meaning, lowest and highest real value, 5th, 50th and 95th
        percentile of the synthetic crops, and ``within``: whether the median is in the real range.
    """
    rows = []
    for name, (unit, meaning) in PROPERTIES.items():
        known = real[name].dropna()
        low, high = (float(known.min()), float(known.max())) if len(known) else (np.nan, np.nan)
        p5, p50, p95 = synthetic[name].quantile([0.05, 0.5, 0.95])
        rows.append(
            {"property": name, "unit": unit, "meaning": meaning, "real_low": low,
             "real_high": high, "p5": p5, "p50": p50, "p95": p95, "within": low <= p50 <= high}
        )  # fmt: skip
    return pd.DataFrame(rows)


@dataclass(frozen=True)
class Separability:
    """How well a classifier separates real from synthetic crops.

    Attributes:
        auc: area under the ROC curve in cross-validation; 0.5 means not separable.
        spread: its standard deviation over the repetitions.
        features: AUC of each feature alone, in the better direction, highest first.
    """

    auc: float
    spread: float
    features: pd.Series


def crop_separability(
    real: pd.DataFrame, synthetic: pd.DataFrame, repeats: int = REPEATS
) -> Separability:
    """Separate crops by numbers of whole crops, a row each; ``repeats`` as below."""
    from sklearn.metrics import roc_auc_score
    from sklearn.model_selection import StratifiedKFold, cross_val_predict

    x = pd.concat((real, synthetic), ignore_index=True)
    y = np.r_[np.ones(len(real), int), np.zeros(len(synthetic), int)]
    scores = []
    for repeat in range(repeats):
        folds = StratifiedKFold(min(FOLDS, len(real)), shuffle=True, random_state=repeat)
        # There are few real crops, so leaves must be small.
        model = _classifier(leaf=2)
        output = cross_val_predict(model, x, y, cv=folds, method="predict_proba")[:, 1]
        scores.append(roc_auc_score(y, output))
    return Separability(float(np.mean(scores)), float(np.std(scores)), _one_by_one(x, y))


def voxel_separability(
    real: Measured, synthetic: Measured, repeats: int = VOXEL_REPEATS
) -> tuple[Separability, Separability]:
    """Separate by the voxel features of the boosted trees; the folds keep crops whole.

    Args:
        repeats: repetitions of the cross-validation, each with different folds.

    Returns:
        for single voxels, and for crops by the mean output over their voxels.
    """
    from sklearn.metrics import roc_auc_score
    from sklearn.utils import compute_sample_weight

    x = np.concatenate((real.voxels, synthetic.voxels))
    y = np.r_[np.ones(len(real.crop), int), np.zeros(len(synthetic.crop), int)]
    crop = np.r_[real.crop, synthetic.crop + 1 + real.crop.max()]
    crops = np.unique(crop)
    is_real = crops <= real.crop.max()
    voxel_scores, crop_scores = [], []
    for repeat in range(repeats):
        rng = np.random.default_rng(repeat)
        fold = np.empty(len(crops), int)
        for kind in (is_real, ~is_real):
            fold[kind] = rng.permutation(kind.sum()) % FOLDS
        output = np.empty(len(y))
        for k in range(FOLDS):
            left_out = np.isin(crop, crops[fold == k])
            known, of_known = x[~left_out], y[~left_out]
            fitted = _not_held_out(of_known)
            weights = compute_sample_weight("balanced", of_known)
            bins = QuantileBins(known[fitted], weights[fitted])
            model = _classifier(leaf=200).fit(bins.numbers(known), of_known)
            output[left_out] = model.decision_function(bins.numbers(x[left_out]))
        voxel_scores.append(roc_auc_score(y, output))
        mean = pd.Series(output).groupby(crop).mean()
        crop_scores.append(roc_auc_score(is_real, mean.loc[crops]))
    features = _one_by_one(pd.DataFrame(x, columns=[f.name for f in FEATURES]), y)
    voxels, whole = (
        Separability(float(np.mean(s)), float(np.std(s)), features)
        for s in (voxel_scores, crop_scores)
    )
    return voxels, whole


def _not_held_out(y: np.ndarray) -> np.ndarray:
    """The rows that ``_classifier`` grows trees from. With more than 10 000 rows, scikit-learn
    holds a tenth out, to stop when their score no longer rises."""
    from sklearn.model_selection import train_test_split

    rows = np.arange(len(y))
    if len(rows) <= 10_000:
        return rows
    seed = np.random.RandomState(0).randint(np.iinfo(np.uint32).max, dtype="u8")
    return train_test_split(rows, test_size=0.1, stratify=y, random_state=seed)[0]


def _classifier(leaf: int) -> HistGradientBoostingClassifier:
    from sklearn.ensemble import HistGradientBoostingClassifier

    return HistGradientBoostingClassifier(
        max_iter=80, min_samples_leaf=leaf, max_leaf_nodes=8, class_weight="balanced",
        random_state=0,
    )  # fmt: skip


def _one_by_one(x: pd.DataFrame, y: np.ndarray) -> pd.Series:
    from sklearn.metrics import roc_auc_score

    alone = {}
    for name, column in x.items():
        filled = column.fillna(column.median() if column.notna().any() else 0.0)
        auc = roc_auc_score(y, filled)
        alone[str(name)] = max(auc, 1 - auc)
    return pd.Series(alone).sort_values(ascending=False)


def all_tests(real: Measured, synthetic: Measured) -> dict[str, Separability]:
    """Separability by each kind of features."""
    voxels, crops = voxel_separability(real, synthetic)
    return {
        "properties of a crop": crop_separability(real.properties, synthetic.properties),
        "statistics of its voxels": crop_separability(real.grids, synthetic.grids),
        "features of one voxel": voxels,
        "features of all voxels of a crop": crops,
    }


def markdown(table: pd.DataFrame, tests: Mapping[str, Separability], crops: tuple[int, int]) -> str:
    """The tables as text.

    Args:
        table: of ``compare_properties``.
        tests: of ``all_tests``.
        crops: number of real and of synthetic crops.
    """
    lines = [
        f"| property | unit | real ({crops[0]}) | synthetic ({crops[1]}): 5 %, median, 95 % |"
        " median in the real range |",
        "|---|---|---|---|---|",
    ]
    for row in table.to_dict("records"):
        spread = ", ".join(f"{row[q]:.3g}" for q in ("p5", "p50", "p95"))
        lines.append(
            f"| {row['meaning']} | {row['unit']} | {row['real_low']:.3g} to {row['real_high']:.3g}"
            f" | {spread} | {'yes' if row['within'] else '**no**'} |"
        )
    lines += ["", "| separated by | AUC | best single features |", "|---|---|---|"]
    for name, test in tests.items():
        best = ", ".join(f"{key} {value:.2f}" for key, value in test.features.head(6).items())
        lines.append(f"| {name} | {test.auc:.2f} ± {test.spread:.2f} | {best} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m scenenet.experiments.domain_gap.compare_crops",
        description="Compare real TS40K crops with synthetic ones, property by property.",
    )
    parser.add_argument("--real", required=True, help="folder of TS40K samples")
    parser.add_argument("--towers", type=int, default=100, help="synthetic crops (default 100)")
    parser.add_argument("--seed", type=int, default=0, help="seed of the synthetic corridor")
    parser.add_argument(
        "--settings", default="{}", help="further settings of the corridor, as JSON"
    )
    arguments = parser.parse_args()
    settings = SyntheticSettings(
        towers=arguments.towers, seed=arguments.seed, **json.loads(arguments.settings)
    )
    real, synthetic = measure(real_crops(arguments.real)), measure(synthetic_crops(settings))
    table = compare_properties(real.properties, synthetic.properties)
    crops = (len(real.properties), len(synthetic.properties))
    print(markdown(table, all_tests(real, synthetic), crops))


if __name__ == "__main__":
    main()
