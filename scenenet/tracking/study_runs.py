"""A study as an MLflow experiment of its own: a parent for each variant, a nested run per seed."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import pandas as pd

from scenenet.experiments.run_tables import TIMES
from scenenet.experiments.studies.settings import StudySettings, Variant
from scenenet.metrics.score_columns import DECISIVE_FIRST
from scenenet.tracking.model_runs import data_of, origin_tags
from scenenet.tracking.run_log import NOTE_TAG, DatasetRecord, RunGroup, RunRecord

if TYPE_CHECKING:
    from scenenet.figures import Picture

FACTS = (
    "tau", "alive", "training_crops", "scored_crops", "parameters", "epochs", "loss",
    "lowest_weight", "lowest_shape",
)  # fmt: skip

GIVEN = ("training_crops", "scored_crops", "parameters", "epochs")
"""Facts that the variant determines; they have no spread over seeds."""


def note_of(study: StudySettings) -> str:
    """The description of the MLflow experiment of a study."""
    return f"{study.title}. {study.asks} Thesis {study.place}; scores on the {study.part} crops."


def study_groups(
    study: StudySettings,
    runs: pd.DataFrame,
    dataset: str,
    protocol: str = "",
    provenance: Mapping[str, Any] | None = None,
    pictures: Sequence[Picture] = (),
) -> list[RunGroup]:
    """The runs of a study.

    Args:
        runs: of ``scenenet.experiments.studies.run``, a row per variant and seed, with times
            (``scenenet.experiments.run_tables.with_times``).
        dataset: name of the data; part of every key, so that runs on other data are kept.
        protocol: how the data were split and voxelised, for a tag.
        provenance: record of the study, for tags and the data set.
        pictures: figures of the whole study, attached to every variant.
    """
    tags = {
        "study": study.name,
        "dataset": dataset,
        "protocol": protocol,
        "place": study.place,
        "model": study.model,
        **origin_tags(provenance or {}),
    }
    datasets = data_of(dataset, tags, f"{study.part}_")
    groups = []
    for variant in study.all_variants():
        rows = runs[runs["variant"] == variant.name].to_dict("records")
        if not rows:
            continue
        own = tags | {"kind": str(rows[0]["kind"]), "variant": variant.name}
        key = f"study-{study.name}/{dataset}/{variant.name}"
        params = _params(study, variant)
        children = [_seed_record(row, key, params, own, datasets, study.part) for row in rows]
        note = f"{study.asks} Mean over {len(rows)} seeds; thesis {study.place}."
        parent = RunRecord(
            key=key,
            name=variant.name,
            params=params,
            metrics=_means([child.metrics for child in children]),
            tags=own | {NOTE_TAG: note},
            artifacts={f"figures/{picture.file.name}": picture.file for picture in pictures},
            seconds=sum(child.seconds for child in children),
        )
        groups.append(RunGroup(parent, children))
    return groups


def _params(study: StudySettings, variant: Variant) -> dict[str, Any]:
    """The settings of a variant; lists as JSON, because MLflow keeps plain text."""
    changes = study.common | variant.changes
    plain = {
        name: json.dumps(value) if isinstance(value, list | tuple) else value
        for name, value in changes.items()
    }
    return {"variant": variant.name, **plain}


def _seed_record(
    row: Mapping[str, Any],
    group: str,
    params: Mapping[str, Any],
    tags: Mapping[str, str],
    datasets: Sequence[DatasetRecord],
    part: str,
) -> RunRecord:
    """The run of one seed of a variant.

    Args:
        row: of the table of runs.
        group: key of the variant.
        params, tags: of the variant.
        datasets: data of the study.
        part: part of the split that was scored.
    """
    seed = row["seed"]
    own = {"kind": str(row["kind"]), "seed": str(seed), "alive": str(bool(row["alive"])).lower()}
    return RunRecord(
        key=f"{group}/seed-{seed}",
        name=f"{row['variant']}, seed {seed}",
        params={**params, "seed": seed},
        metrics=_metrics(row, part),
        tags={**tags, **own},
        datasets=datasets,
        seconds=float(row["training_seconds"]),
    )


def _metrics(row: Mapping[str, Any], part: str) -> dict[str, float | None]:
    metrics: dict[str, float | None] = {
        f"{part}_{name}": float(row[name]) for name in (*DECISIVE_FIRST, "average_precision")
    }
    return metrics | {name: float(row[name]) for name in (*FACTS, *TIMES)}


def _means(seeds: Sequence[Mapping[str, float | None]]) -> dict[str, float | None]:
    """Means under the names of the metrics of the seeds, so that both share a column in MLflow."""
    means: dict[str, float | None] = {}
    for name in seeds[0]:
        values = [v for seed in seeds if (v := seed[name]) is not None and not math.isnan(v)]
        if values:
            mean = sum(values) / len(values)
            means[name] = mean
            if len(values) > 1 and name not in GIVEN:
                square = sum((value - mean) ** 2 for value in values)
                means[f"{name}_std"] = math.sqrt(square / (len(values) - 1))
    return means | {"seeds": len(seeds)}
