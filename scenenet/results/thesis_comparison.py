"""Every published number compared with the number of this run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from scenenet.core.files import atomic
from scenenet.experiments.published import Published, Thesis
from scenenet.experiments.studies.findings import as_good_as_best
from scenenet.experiments.studies.settings import StudySettings
from scenenet.experiments.studies.summary import summarise
from scenenet.metrics.score_columns import PUBLISHED_SCORES
from scenenet.results import tables
from scenenet.results.folder import Results, SeedResult

COLUMNS = ("name", "place", "what", "unit", "thesis", "spread", "low", "high", "ours", "verdict",
           "remark")  # fmt: skip

REPRODUCED, BETTER, NOT, UNMEASURED = "reproduced", "better", "not", "not measured"

SCORE_TOLERANCE = 0.05
"""Scores within this difference are equal; the spread over seeds in the thesis is up to 0.08."""
TOLERANCE = 0.2
"""Other numbers are equal within this relative difference."""

TIME_NAMES = ("times.", "voxelisation.")
"""Beginnings of the names of published times."""

SCORE_ENDINGS = tuple(f".{name}" for name in PUBLISHED_SCORES)
"""Endings of the names of published scores."""

REMARKS: Mapping[str, str] = {
    "data.": "A number of the data of the thesis; the section on the surveys describes the data "
    "of this run.",
    "class_share.": "Other land, and the labels of the crops use other codes than Table 5.1 "
    "(docs/method/synthetic.md).",
    "towers.": "Other lines: the public crops have poles of 10 to 20 m, the statistics of the "
    "thesis are of pylons.",
    "voxelisation.": "Time on the machine of this run; points are counted without sorting.",
    "protocol.epochs_needed": "The fewest epochs with an F0.5 equal to the best within the spread "
    "over seeds; an epoch has fewer steps in this run.",
    "protocol.crops_needed": "The fewest training crops, of the numbers tried, with an F0.5 "
    "equal to the best within the spread over seeds.",
    "protocol.": "A setting and not a result, chosen for other and fewer crops.",
    "parameters.": "Weights of two runs can be compared only if the values of their kernels are "
    "similar.",
    "models.": "Other and fewer crops than in the thesis.",
    "times.": "Time on the machine of this run, with other and fewer crops.",
    "kernel_size.": "Other and fewer crops than in the thesis.",
    "ablation.": "Other and fewer crops than in the thesis.",
    "starts.": "Other and fewer crops than in the thesis.",
    "measurement.": "Measured by F0.5 in this run, by the loss in the thesis.",
    "loss.": "Depends on the data and on the weights f_w.",
}
"""Why a number differs from the published one, by the beginning of its name."""


def compare(results: Results, thesis: Thesis) -> pd.DataFrame:
    """A row per published number, in the order of the thesis.

    ``verdict`` is ``reproduced`` (within tolerance or inside the published range), ``better`` (a
    higher score, a shorter time), ``not``, or ``not measured``; every row that is neither of the
    first two has a ``remark``.
    """
    ours = _ours(results, thesis)
    rows = []
    for name, number in thesis.numbers.items():
        value = ours.get(name)
        verdict = _verdict(name, number, value)
        remark = "" if verdict in (REPRODUCED, BETTER) else _remark(name)
        rows.append((name, number.place, number.what or name, number.unit, number.value,
                     number.spread, number.low, number.high, value, verdict, remark))  # fmt: skip
    return pd.DataFrame(rows, columns=list(COLUMNS))


def write_comparison(
    results: Results, thesis: Thesis, out: str | Path, out_times: str | Path
) -> None:
    """Write ``compare`` as two CSV files: times apart, because they differ between equal runs."""
    every = compare(results, thesis)
    timed = every["name"].str.startswith(TIME_NAMES)
    for part, path in ((every[~timed], out), (every[timed], out_times)):
        with atomic(path) as partial:
            part.to_csv(partial, index=False, float_format="%.6g")


def _verdict(name: str, number: Published, ours: float | None) -> str:
    if ours is None or ours != ours:
        return UNMEASURED
    if name.startswith(TIME_NAMES):
        bound = number.value if number.value is not None else number.high
        assert bound is not None, name
        # A negative bound is a time saved: the lower, the better.
        better = bound / (1 + TOLERANCE) if bound > 0 else bound * (1 + TOLERANCE)
        return BETTER if ours < better else _near(number, ours)
    if name.endswith(SCORE_ENDINGS) and not name.startswith("models.lift"):
        assert number.value is not None, name
        if ours > number.value + SCORE_TOLERANCE:
            return BETTER
        return REPRODUCED if ours >= number.value - SCORE_TOLERANCE else NOT
    if name.endswith("alive_share"):
        assert number.value is not None, name
        return BETTER if ours > number.value * (1 + TOLERANCE) else _near(number, ours)
    return _near(number, ours)


def _near(number: Published, ours: float) -> str:
    if number.low is not None or number.high is not None:
        low = number.low if number.low is not None else float("-inf")
        high = number.high if number.high is not None else float("inf")
        if low <= ours <= high:
            return REPRODUCED
    if number.value is None:
        return NOT
    return REPRODUCED if abs(ours - number.value) <= TOLERANCE * abs(number.value) else NOT


def _remark(name: str) -> str:
    return next((text for start, text in REMARKS.items() if name.startswith(start)), "")


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
    name = _first(results, "scenenet")
    trained = [] if name is None else results.of_model(name)
    settings = _settings(trained[0]) if trained else {}
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


def _settings(trained: SeedResult) -> Mapping[str, Any]:
    """The settings of a training; empty if its record has none."""
    return (trained.provenance or {}).get("settings") or {}


def _of_models(results: Results, thesis: Thesis) -> dict[str, float | None]:
    """Each architecture is represented by its first model, with the mean over all seeds."""
    found: dict[str, float | None] = {}
    every = tables.models(results, thesis)
    for kind in ("scenenet", "cnn"):
        name = _first(results, kind)
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
        rows = times[times["model"] == _first(results, kind)]
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


def _first(results: Results, kind: str) -> str | None:
    """The first model of an architecture, preferably one of the thesis protocol."""
    names = [model for model, k in results.models.items() if k == kind]
    for name in names:
        trained = results.of_model(name)
        if trained and _settings(trained[0]).get("protocol", "thesis") == "thesis":
            return name
    return names[0] if names else None


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
