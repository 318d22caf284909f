"""Every published number beside the number of this run, without a verdict."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from scenenet.core.files import atomic
from scenenet.experiments.published import Thesis
from scenenet.experiments.studies.findings import as_good_as_best
from scenenet.experiments.studies.settings import StudySettings
from scenenet.experiments.studies.summary import summarise
from scenenet.metrics.score_columns import PUBLISHED_SCORES
from scenenet.results import tables
from scenenet.results.claims.evidence import representative, settings_of
from scenenet.results.folder import Results

COLUMNS = ("name", "place", "what", "unit", "thesis", "spread", "low", "high", "ours")

TIME_NAMES = ("times.", "voxelisation.")
"""Beginnings of the names of published times."""


def published_numbers(results: Results, thesis: Thesis) -> pd.DataFrame:
    """A row per published number, in the order of the thesis, with the number of this run.

    Most are settings, counts and single scores, which agree or differ for many reasons; what the
    thesis concludes from them is judged by ``scenenet.results.claims``.
    """
    ours = _ours(results, thesis)
    rows = [
        (name, number.place, number.what or name, number.unit, number.value, number.spread,
         number.low, number.high, ours.get(name))
        for name, number in thesis.numbers.items()
    ]  # fmt: skip
    return pd.DataFrame(rows, columns=list(COLUMNS))


def write_published_numbers(
    results: Results, thesis: Thesis, out: str | Path, out_times: str | Path
) -> None:
    """Write ``published_numbers`` as two CSV files: times apart, because they differ between equal
    runs."""
    every = published_numbers(results, thesis)
    timed = every["name"].str.startswith(TIME_NAMES)
    for part, path in ((every[~timed], out), (every[timed], out_times)):
        with atomic(path) as partial:
            part.to_csv(partial, index=False, float_format="%.6g")


def _ours(results: Results, thesis: Thesis) -> dict[str, float | None]:
    """The number of this run for each published name, if it has one."""
    found: dict[str, float | None] = {}
    for gather in (_of_data, _of_settings, _of_models, _of_times, _of_studies):
        found |= gather(results, thesis)
    return found


def _of_data(results: Results, thesis: Thesis) -> dict[str, float | None]:
    found: dict[str, float | None] = {}
    classes = tables.classes(results, thesis)
    for row in classes.to_dict("records"):
        found[f"class_share.{row['code']}"] = row["share_percent"]
    if len(classes):
        found["data.tower_share"] = found.get("class_share.15")
    for row in tables.towers(results, thesis).to_dict("records"):
        found[f"towers.{row['property']}"] = row["mean"]
    for row in tables.voxelisation(results, thesis).to_dict("records"):
        found[f"voxelisation.{str(row['grid']).removeprefix('cube-')}"] = row["seconds"]
        found["data.crops"] = row["samples"]
    split = results.split()
    if split is not None:
        for part in ("train", "validation", "test"):
            found[f"protocol.{part}_share"] = 100 * float((split["part"] == part).mean())
    return found


SETTINGS: Mapping[str, str] = {
    "batch_size": "training.batch_size",
    "epochs": "training.epochs",
    "learning_rate": "training.learning_rate",
    "alpha": "training.loss.alpha",
    "epsilon": "training.loss.epsilon",
    "rho_l": "training.loss.rho_mixing",
    "rho_t": "training.loss.rho_shape",
}
"""Published setting -> setting of the model that represents SCENE-Net."""


def _of_settings(results: Results, thesis: Thesis) -> dict[str, float | None]:
    name = representative(results, "scenenet")
    trained = [] if name is None else results.of_model(name)
    settings = settings_of(trained[0]) if trained else {}
    found: dict[str, float | None] = {}
    for ours, dotted in SETTINGS.items():
        value: Any = settings
        for step in dotted.split("."):
            value = value.get(step) if isinstance(value, Mapping) else None
        found[f"protocol.{ours}"] = value
    found["protocol.kernel_side"] = (settings.get("kernel_size") or [None])[0]
    errors = [r.history["fidelity"] for r in trained if r.history is not None]
    if errors:
        found["loss.range"] = float(sum(e.mean() for e in errors) / len(errors))
    return found


def _of_models(results: Results, thesis: Thesis) -> dict[str, float | None]:
    """Each architecture is represented by its first model, with the mean over all seeds."""
    found: dict[str, float | None] = {}
    every = tables.models(results, thesis)
    for kind in ("scenenet", "cnn"):
        name = representative(results, kind)
        rows = every[(every["model"] == name) & (every["counted"] == "all seeds")]
        if rows.empty:
            continue
        row = rows.iloc[0]
        for score in PUBLISHED_SCORES:
            found[f"models.{kind}.{score}"] = float(row[score])
        found[f"models.{kind}.alive_share"] = 100 * float(row["live_share"])
        if pd.notna(row["parameters"]):
            found[f"models.{kind}.parameters"] = float(row["parameters"])
        if kind == "scenenet" and name is not None:
            weights = [
                history["lambda.negative_sphere"].iloc[-1]
                for r in results.of_model(name)
                if (history := r.history) is not None and "lambda.negative_sphere" in history
            ]
            if weights:
                found["parameters.lambda_negative_sphere"] = 100 * sum(weights) / len(weights)
    for score in PUBLISHED_SCORES:
        scenenet, cnn = (found.get(f"models.{kind}.{score}") for kind in ("scenenet", "cnn"))
        if scenenet is not None and cnn is not None:
            found[f"models.lift.{score}"] = 100 * (scenenet - cnn)
    return found


def _of_times(results: Results, thesis: Thesis) -> dict[str, float | None]:
    times = tables.times(results, thesis)
    if times.empty:
        return {}
    found: dict[str, float | None] = {}
    for kind in ("scenenet", "cnn"):
        rows = times[times["model"] == representative(results, kind)]
        if rows.empty:
            continue
        row = rows.iloc[0]
        if kind == "scenenet":
            minutes = float(row["training_seconds"]) / 60
            found |= {"times.training": minutes, "times.training_bound": minutes}
        found[f"times.{kind}.inference"] = float(row["inference_ms"])
        found[f"times.{kind}.training_useful"] = float(row["useful_seconds"]) / 3600
    scenenet, cnn = (found.get(f"times.{kind}.inference") for kind in ("scenenet", "cnn"))
    if scenenet is not None and cnn is not None:
        found["times.lift.inference"] = scenenet - cnn
    return found


def _of_studies(results: Results, thesis: Thesis) -> dict[str, float | None]:
    found: dict[str, float | None] = {}
    for study in results.studies:
        runs = results.study_runs(study.name)
        if runs is None:
            continue
        summary = summarise(study, runs, thesis).set_index("variant")
        for variant in study.all_variants():
            row = summary.loc[variant.name]
            if variant.thesis:
                for score in PUBLISHED_SCORES:
                    found[f"{variant.thesis}.{score}"] = float(row[score])
                found[f"{variant.thesis}.alive_share"] = 100 * float(row["live_share"])
        if study.name == "alpha-epsilon":
            found["loss.combinations"] = len(summary)
        if study.name == "epochs":
            enough = summary.index[as_good_as_best(summary)]
            found["protocol.epochs_needed"] = min(_epochs(study, name) for name in enough)
        if study.name == "split":
            enough = summary.index[as_good_as_best(summary)]
            found["protocol.crops_needed"] = float(summary.loc[enough, "training_crops"].min())
        if study.name == "measurement":
            presence, density = (float(value) for value in summary["f05"].iloc[:2])
            if density:
                found["measurement.presence_lift"] = 100 * (presence - density) / density
    return found


def _epochs(study: StudySettings, variant: str) -> float:
    changes = next(v.changes for v in study.all_variants() if v.name == variant)
    return float(changes["training.epochs"])
