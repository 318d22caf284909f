"""A study as an MLflow experiment of its own: a parent for each variant, a run for each seed."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from scenenet.studies.settings import StudySettings
from scenenet.studies.summary import SCORES
from scenenet.tracking.runs import RunGroup, RunRecord
from scenenet.tracking.store import TrackingSettings

if TYPE_CHECKING:
    import pandas as pd

FACTS = (
    "tau", "alive", "training_crops", "parameters", "epochs", "loss", "training_seconds",
    "inference_ms", "lowest_weight", "lowest_shape",
)  # fmt: skip


def experiment_of(settings: TrackingSettings, study: str) -> TrackingSettings:
    """The settings with the study's own experiment, so that its runs are compared by themselves."""
    return settings.model_copy(update={"experiment": f"{settings.experiment}-{study}"})


def study_groups(study: StudySettings, runs: pd.DataFrame, dataset: str) -> list[RunGroup]:
    """The runs of a study.

    Args:
        runs: of ``scenenet.studies.run``, a row per variant and seed.
        dataset: name of the data, part of every key, so that runs on other data stand beside.
    """
    tags = {"study": study.name, "dataset": dataset, "place": study.place, "model": study.model}
    groups = []
    for variant in study.all_variants():
        rows = runs[runs["variant"] == variant.name].to_dict("records")
        if not rows:
            continue
        key = f"study-{study.name}/{dataset}/{variant.name}"
        params = {
            "variant": variant.name,
            **{
                name: json.dumps(value) if isinstance(value, list | tuple) else value
                for name, value in (study.common | variant.changes).items()
            },
        }
        children = [
            RunRecord(
                key=f"{key}/seed-{row['seed']}",
                name=f"{variant.name}, seed {row['seed']}",
                params=params | {"seed": row["seed"]},
                metrics=_metrics(row, study.part),
                tags=tags
                | {"kind": str(row["kind"]), "variant": variant.name, "seed": str(row["seed"])},
                seconds=float(row["training_seconds"]),
            )
            for row in rows
        ]
        parent = RunRecord(
            key=key,
            name=variant.name,
            params=params,
            metrics=_means([child.metrics for child in children]),
            tags=tags
            | {
                "kind": str(rows[0]["kind"]),
                "variant": variant.name,
                "mlflow.note.content": f"{study.asks} Mean over {len(rows)} seeds; thesis "
                f"{study.place}.",
            },
            seconds=sum(child.seconds for child in children),
        )
        groups.append(RunGroup(parent, children))
    return groups


def _metrics(row: Mapping[str, Any], part: str) -> dict[str, float | None]:
    metrics: dict[str, float | None] = {name: float(row[name]) for name in FACTS}
    for name in (*SCORES, "average_precision"):
        metrics[f"{part}_{name}"] = float(row[name])
    return metrics


def _means(seeds: Sequence[Mapping[str, float | None]]) -> dict[str, float | None]:
    """Means under the names of the seeds' own metrics, so that both stand in one column."""
    means: dict[str, float | None] = {"seeds": len(seeds)}
    for name in seeds[0]:
        values = [v for seed in seeds if (v := seed[name]) is not None and not math.isnan(v)]
        if values:
            mean = sum(values) / len(values)
            means[name] = mean
            if len(values) > 1:
                square = sum((value - mean) ** 2 for value in values)
                means[f"{name}_std"] = math.sqrt(square / (len(values) - 1))
    return means
