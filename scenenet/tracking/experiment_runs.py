"""An experiment of ``scenenet.experiments`` as an MLflow experiment of its own.

Each case (a model, at a level of noise or with a way to count) is a parent run, with a nested run
for each training. Parents and nested runs have metrics of the same names.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from scenenet.experiments.components.summary import case_name as component_name
from scenenet.experiments.cross_validation.summary import CASE, case_name, summarise_folds
from scenenet.experiments.label_noise.settings import LABELS
from scenenet.experiments.registry import EXPERIMENTS
from scenenet.metrics.score_columns import SCORES
from scenenet.tracking.model_runs import data_of, origin_tags
from scenenet.tracking.run_log import NOTE_TAG, RunGroup, RunRecord

if TYPE_CHECKING:
    from scenenet.figures import Picture

NOT_METRICS = ("seed", "model", "voxels", "rules", "level", "fold", "crops")


@dataclass(frozen=True)
class Origin:
    """What all runs of an experiment share.

    Attributes:
        dataset: name of the data; part of every key, so that runs on other data are kept.
        tags: fingerprints of the data, the settings and the code.
        pictures: figures of the experiment, attached to every parent.
    """

    dataset: str
    tags: Mapping[str, str] = field(default_factory=dict)
    pictures: Sequence[Picture] = ()


def origin_of(
    dataset: str,
    joined: Mapping[str, Any],
    job: Mapping[str, Any],
    pictures: Sequence[Picture] = (),
) -> Origin:
    """The origin of the runs of an experiment.

    Args:
        dataset: name of the data.
        joined: provenance record of the table of all runs; the data are taken from it.
        job: provenance record of one of the jobs; all have the same settings and code.
        pictures: figures of the experiment.
    """
    return Origin(dataset, origin_tags({**job, "inputs": joined.get("inputs", {})}), pictures)


def experiment_note(name: str) -> str:
    """The description of the MLflow experiment of an experiment."""
    experiment = EXPERIMENTS[name]
    return f"{experiment.title}. {experiment.contents} Thesis {experiment.place}."


def label_noise_groups(runs: pd.DataFrame, origin: Origin) -> list[RunGroup]:
    """The runs of the label noise experiment: a parent for each level and model, a run per seed.

    Args:
        runs: of ``scenenet.experiments.label_noise.run``, a row per level, seed and model.
        origin: data, settings and code of the runs.
    """
    groups = []
    for (level, model), rows in runs.groupby(["level", "model"], sort=False):
        description = (
            f"Scores of the labels themselves as if a model had predicted them; {level:.0%} of the "
            "tower points are mislabelled."
            if model == LABELS
            else f"Trained with {level:.0%} of the tower points mislabelled. `labels_`: compared "
            "with labels of the same quality; `truth_`: compared with the truth."
        )
        name = f"{model}, {level:.0%} wrong"
        case = {"level": float(level), "model": str(model)}
        groups.append(group_of("label_noise", origin, name, case, rows, description))
    return groups


def fold_groups(runs: pd.DataFrame, origin: Origin) -> list[RunGroup]:
    """The runs of the cross-validation: a parent for each model and way to count, a run for each
    seed and fold.

    Args:
        runs: of ``scenenet.experiments.cross_validation.run``.
        origin: data, settings and code of the runs.
    """
    summary = summarise_folds(runs).set_index(list(CASE))
    groups = []
    for (model, voxels), rows in runs.groupby(list(CASE), sort=False):
        row = summary.loc[(model, voxels)]
        description = (
            f"Cross-validation over {row['crops']} crops in {row['n_folds']} folds. Metrics are "
            "means over folds and seeds; `spread_` is the standard deviation over seeds of the "
            "mean over folds; `pooled_` is computed from the counts of all folds together. "
            "`truth_` is measured against the truth, where it is known, the others against the "
            "labels."
        )
        group = group_of(
            "cross_validation",
            origin,
            case_name(str(model), str(voxels)),
            {"model": str(model), "voxels": str(voxels)},
            rows,
            description,
            lambda row: f"seed-{row['seed']}/fold-{row['fold']}",
        )
        more = {f"spread_{name}": _number(row[f"{name}_std"]) for name in SCORES}
        more |= {f"pooled_{name}": _number(row[f"pooled_{name}"]) for name in SCORES}
        parent = replace(group.parent, metrics={**group.parent.metrics, **more})
        groups.append(replace(group, parent=parent))
    return groups


def component_groups(runs: pd.DataFrame, origin: Origin) -> list[RunGroup]:
    """The runs of the experiment that takes the method apart: a parent for each source and answer,
    a run for each seed and fold.

    Args:
        runs: of ``scenenet.experiments.components.run``.
        origin: data, settings and code of the runs.
    """
    description = (
        "`point_`: points; `voxel_`: voxels; `towers_`: towers. `truth_` is measured against the "
        "truth, where it is known, the others against the labels."
    )
    return [
        group_of(
            "components",
            origin,
            component_name(str(model), str(rules)),
            {"model": str(model), "rules": str(rules)},
            rows,
            description,
            lambda row: f"seed-{row['seed']}/fold-{row['fold']}",
        )
        for (model, rules), rows in runs.groupby(["model", "rules"], sort=False)
    ]


EXPERIMENT_GROUPS: Mapping[str, Callable[[pd.DataFrame, Origin], list[RunGroup]]] = {
    "cross_validation": fold_groups,
    "components": component_groups,
    "label_noise": label_noise_groups,
}
"""The MLflow runs of each experiment of ``scenenet.experiments.registry``."""


def group_of(
    experiment: str,
    origin: Origin,
    name: str,
    case: Mapping[str, Any],
    rows: pd.DataFrame,
    description: str,
    child: Callable[[Mapping[str, Any]], str] = lambda row: f"seed-{row['seed']}",
) -> RunGroup:
    """A parent with the means of its rows, and a nested run for each row.

    Args:
        experiment: name in ``scenenet.experiments.registry``.
        origin: data, settings and code of the runs.
        name: of the parent, unique in the experiment.
        case: what the rows have in common; parameters of all runs.
        rows: one per training.
        description: of the parent.
        child: ending of the key of a row, unique among the rows.
    """
    place = EXPERIMENTS[experiment].place
    key = f"{experiment}/{origin.dataset}/{name}"
    tags = {"study": experiment, "dataset": origin.dataset, "place": place, **origin.tags}
    tags["model"] = str(case["model"])
    numbers = [c for c in rows.columns if c not in NOT_METRICS]
    children = []
    for row in rows.to_dict("records"):
        metrics = {column: _number(row[column]) for column in numbers}
        rest = {column: row[column] for column in NOT_METRICS if column in row}
        alive = {"alive": str(bool(row["alive"])).lower()}
        children.append(
            RunRecord(
                key=f"{key}/{child(row)}",
                name=f"{name}, {child(row).replace('-', ' ').replace('/', ', ')}",
                params={**case, **rest},
                metrics=metrics,
                tags=tags | alive | {"seed": str(row["seed"])},
                datasets=data_of(origin.dataset, tags),
                seconds=metrics.get("training_seconds") or 0.0,
            )
        )
    parent = RunRecord(
        key=key,
        name=name,
        params=case,
        metrics=_means(children),
        tags=tags | {NOTE_TAG: f"{description} Mean over {len(rows)} runs. Thesis {place}."},
        artifacts={f"figures/{p.file.name}": p.file for p in origin.pictures},
        seconds=sum(record.seconds for record in children),
    )
    return RunGroup(parent, children)


def _number(value: Any) -> float | None:
    number = float(value) if value is not None else float("nan")
    return number if np.isfinite(number) else None


def _means(children: Sequence[RunRecord]) -> dict[str, float | None]:
    """Means under the names of the metrics of the runs, so that both share a column in MLflow."""
    means: dict[str, float | None] = {"runs": len(children)}
    for name in children[0].metrics:
        values = [v for record in children if (v := record.metrics[name]) is not None]
        if values:
            means[name] = float(np.mean(values))
        if len(values) > 1:
            means[f"{name}_std"] = float(np.std(values, ddof=1))
    return means
