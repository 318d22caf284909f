"""An experiment as an MLflow experiment of its own: a parent for each model and case, and a run for
each seed, with the same names of metrics."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from scenenet.experiments.cross_validation.summary import SCORES, summarise_folds
from scenenet.experiments.label_noise.settings import LABELS
from scenenet.tracking.model_runs import origin_tags
from scenenet.tracking.run_log import NOTE_TAG, RunGroup, RunRecord

if TYPE_CHECKING:
    import pandas as pd

    from scenenet.figures import Picture

NOT_METRICS = ("seed", "model", "level", "fold", "crops")


@dataclass(frozen=True)
class Origin:
    """What all runs of an experiment share.

    Attributes:
        dataset: name of the data, part of every key, so that runs of other data stand beside.
        tags: what they were made from and by.
        pictures: figures of the whole experiment, attached to every parent.
    """

    dataset: str
    tags: Mapping[str, str] = field(default_factory=dict)
    pictures: Sequence[Picture] = ()


def origin_of(
    dataset: str,
    gathered: Mapping[str, Any],
    job: Mapping[str, Any],
    pictures: Sequence[Picture] = (),
) -> Origin:
    """What the runs share, from the record of the gathered table and that of one of its jobs: the
    settings and the code are those of the jobs, the data those of all of them."""
    return Origin(dataset, origin_tags({**job, "inputs": gathered.get("inputs", {})}), pictures)


def noise_groups(runs: pd.DataFrame, origin: Origin) -> list[RunGroup]:
    """The runs of the noise study.

    Args:
        runs: of ``scenenet.experiments.label_noise.run``, a row per level, seed and model.
    """
    groups = []
    for (level, model), rows in runs.groupby(["level", "model"], sort=False):
        told = (
            f"F0.5 and more of the labels themselves, {level:.0%} of them wrong, as if they were "
            "the answer of a model."
            if model == LABELS
            else f"Trained on labels of which {level:.0%} are wrong; labels_ is against such "
            "labels, truth_ against the truth."
        )
        case = {"level": float(level), "model": str(model)}
        name = f"{model}, {level:.0%} wrong"
        groups.append(group_of("label_noise", origin, name, case, rows, told, "5.2.5"))
    return groups


def fold_groups(runs: pd.DataFrame, origin: Origin) -> list[RunGroup]:
    """The runs of the cross-validation: a parent for each model, a run for each seed and fold.

    Args:
        runs: of ``scenenet.experiments.cross_validation.run``.
    """
    summary = summarise_folds(runs).set_index("model")
    groups = []
    for model, rows in runs.groupby("model", sort=False):
        row = summary.loc[model]
        told = (
            f"Cross-validated over {row['crops']} crops in {row['n_folds']} folds. Means over "
            "folds and seeds; spread_ is that of the mean over folds over the seeds, pooled_ of "
            "the counts of all folds together."
        )
        group = group_of(
            "cross_validation", origin, str(model), {"model": str(model)}, rows, told, "5.2.4",
            lambda row: f"seed-{row['seed']}/fold-{row['fold']}",
        )  # fmt: skip
        more = {f"spread_{name}": _number(row[f"{name}_std"]) for name in SCORES}
        more |= {f"pooled_{name}": _number(row[f"pooled_{name}"]) for name in SCORES}
        parent = replace(group.parent, metrics={**group.parent.metrics, **more})
        groups.append(replace(group, parent=parent))
    return groups


def group_of(
    experiment: str,
    origin: Origin,
    name: str,
    case: Mapping[str, Any],
    rows: pd.DataFrame,
    told: str,
    place: str,
    child: Callable[[Mapping[str, Any]], str] = lambda row: f"seed-{row['seed']}",
) -> RunGroup:
    """A parent with the means of its rows, and a run for each of them.

    Args:
        name: of the parent, unique in the experiment.
        case: what the rows have in common; parameters of all runs.
        told: description of the parent.
        place: where the thesis asks for it.
        child: what tells a row from the others.
    """
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
                seconds=metrics.get("training_seconds") or 0.0,
            )
        )
    parent = RunRecord(
        key=key,
        name=name,
        params=case,
        metrics=_means(children),
        tags=tags | {NOTE_TAG: f"{told} Mean over {len(rows)} runs. Thesis {place}."},
        artifacts={f"figures/{p.file.name}": p.file for p in origin.pictures},
        seconds=sum(record.seconds for record in children),
    )
    return RunGroup(parent, children)


def _number(value: Any) -> float | None:
    number = float(value) if value is not None else float("nan")
    return number if np.isfinite(number) else None


def _means(children: Sequence[RunRecord]) -> dict[str, float | None]:
    """Means under the names of the runs' own metrics, so that both stand in one column."""
    means: dict[str, float | None] = {"runs": len(children)}
    for name in children[0].metrics:
        values = [v for record in children if (v := record.metrics[name]) is not None]
        if values:
            means[name] = float(np.mean(values))
        if len(values) > 1:
            means[f"{name}_std"] = float(np.std(values, ddof=1))
    return means


EXPERIMENT_NOTES = {
    "cross_validation": "Every crop a test crop once, over all models and seeds.",
    "label_noise": "Trained on labels of which a known share is wrong, scored against such labels "
    "and against the truth. Thesis 5.2.5.",
}
"""The description of each experiment."""

EXPERIMENT_GROUPS: Mapping[str, Callable[[pd.DataFrame, Origin], list[RunGroup]]] = {
    "cross_validation": fold_groups,
    "label_noise": noise_groups,
}
"""The runs of each experiment, by its name."""
