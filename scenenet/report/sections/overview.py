"""The opening of the report: what was measured, how good the model is, how others compare."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

from scenenet.metrics.score_columns import (
    AT_TAU,
    SCORE_COLUMNS,
    VOXELS,
    WHOLE_TOWERS,
    score_text,
)
from scenenet.models.settings import BOOSTED_TREES
from scenenet.report.blocks import Block, Facts, Section, Text, write
from scenenet.report.context import Against, ReportContext, against
from scenenet.results.score_tables import TRIVIAL

SAME = 0.02
"""F0.5 scores that differ by less are called equal."""

PARTS = {AT_TAU: "tau", WHOLE_TOWERS: "towers"}
"""Way to count -> beginning of its columns in ``tables/whole_towers.csv``."""


def overview(context: ReportContext) -> Section:
    """The model that classifies surveys, and one sentence for each other model."""
    models = context.table("models")
    results = context.results
    facts: list[tuple[str, str]] = []
    blocks: list[Block] = [Text("No model has been evaluated in this run.")]
    if models is not None:
        measured = against(models, "f05")[0]
        first = _representative(models, results.predicting or models["model"].iloc[0])
        others = [
            _representative(models, name)
            for name in dict.fromkeys([*results.models, BOOSTED_TREES])
            if name != first["model"] and (models["model"] == name).any()
        ]
        blocks = [Text(_task(context, first)), Text(_headline(context, first, measured))]
        blocks += [Text(_comparison(context, other, first, measured)) for other in others]
        blocks.append(Text(_terms(models)))
        known = f", against the {measured.name}" if measured.prefix else ""
        facts = [
            (
                f"{column.label} of {first['model']}{known}",
                write(first[f"{measured.prefix}{column.name}"], "score"),
            )
            for column in SCORE_COLUMNS
            if column.tower_only
        ]
        facts += [
            (f"live models, {model}", f"{sum(r.alive for r in of)} of {len(of)}")
            for model in results.models
            if (of := results.of_model(model))
        ]
    predicted = [p for survey in results.predicted if (p := results.prediction(survey))]
    if predicted:
        found = sum(len(prediction.towers) for prediction in predicted)
        facts.append(("towers found in new surveys", write(found, "count")))
    return Section("overview", "Summary", [*blocks[:2], Facts(facts), *blocks[2:]])


def _task(context: ReportContext, first: Mapping[Any, Any]) -> str:
    """What was trained and what was tested."""
    n_crops = context.results.of_model(first["model"])[0].evaluation.voxel.n_samples
    return (
        "This run trains models to find the towers of power lines in airborne LiDAR point clouds. "
        "The points around each labelled tower are cut out (a crop) and put on a grid of voxels. A "
        "model gives each voxel the probability that it contains a tower; voxels with a "
        "probability at or above a threshold tau are predicted as tower. All scores are measured "
        "on "
        f"{n_crops} test crops that were not used to train or tune any model."
    )


def _headline(context: ReportContext, first: Mapping[Any, Any], measured: Against) -> str:
    precision, recall = (_share(first[f"{measured.prefix}{n}"]) for n in ("precision", "recall"))
    labelled, of_labels = "labelled tower", ""
    if measured.prefix:
        labelled = "tower in truth"
        precise, complete = _share(first["precision"]), _share(first["recall"])
        of_labels = (
            f" Against the labels, whose annotators include the surroundings of a tower, they are "
            f"{precise} and {complete}."
        )
    return (
        f"{first['model']}, {_kind(context, first)}, classifies the new surveys. Of the voxels it "
        f"predicts as tower, {precision} are {labelled} (precision); it finds {recall} of the "
        f"{measured.adjective} tower voxels (recall). These numbers are for "
        f"{_seeds(first)}; they count {_counted(first)}.{of_labels}"
    )


def _comparison(
    context: ReportContext,
    other: Mapping[Any, Any],
    first: Mapping[Any, Any],
    measured: Against,
) -> str:
    """The scores of another model, compared with the first one counted in the same way."""
    precision, recall, f05 = (
        other[f"{measured.prefix}{name}"] for name in ("precision", "recall", "f05")
    )
    reference = first[f"{measured.prefix}f05"]
    scores = (
        f"{other['model']}, {_kind(context, other)}: precision {score_text(precision)}, "
        f"recall {score_text(recall)} ({_seeds(other)}; {_counted(other)})."
    )
    if pd.isna(f05) or pd.isna(reference):
        return scores
    if not recall:
        return f"{scores} It detects no tower voxel."
    if other["voxels"] == first["voxels"]:
        return f"{scores} {_difference(f05, reference, str(first['model']))}"
    return f"{scores}{_same_way(context, other, first, measured)}"


def _difference(other: float, first: float, name: str) -> str:
    difference = other - first
    if abs(difference) < SAME:
        verdict = f"as {name}"
    else:
        verdict = f"{abs(difference):.2f} {'above' if difference > 0 else 'below'} {name}"
    return f"F0.5 {other:.2f}, {verdict}."


def _same_way(
    context: ReportContext,
    other: Mapping[Any, Any],
    first: Mapping[Any, Any],
    measured: Against,
) -> str:
    """Both models scored the same way, if their own ways differ."""
    frame = context.table("whole_towers")
    if frame is None:
        return ""
    rows = frame.set_index("model")
    seeds = int(rows.loc[first["model"], "n_seeds"])
    pairs = []
    for voxels in reversed(VOXELS):
        column = f"{measured.prefix}{PARTS[voxels]}_f05"
        ours, reference = (rows.loc[row["model"], column] for row in (other, first))
        pairs.append(
            f"{score_text(ours)} against {score_text(reference)} for {first['model']} ({voxels})"
        )
    seeds_said = "one seed" if seeds == 1 else f"mean of {seeds} seeds"
    return f" Scored the same way, {seeds_said}: F0.5 {' and '.join(pairs)}."


def _terms(models: pd.DataFrame) -> str:
    """What a reader needs to know to read the scores."""
    trivial = models.loc[models["model"] == TRIVIAL, "miou"].iloc[0]
    return (
        "F0.5 combines precision and recall and gives precision twice the weight. tau is chosen on "
        "validation crops. Scores count in one of two ways: the voxels at or above tau, as in the "
        "thesis, or all voxels of the whole towers that are found with them. The IoU (intersection "
        "over union) of the thesis is the mean over background and tower; a model that never "
        f"predicts tower already scores {score_text(trivial)}, so the IoU of the tower class alone "
        "is given as well. A model is live if it detects at least one tower voxel."
    )


def _share(value: float) -> str:
    return "a share that is not defined" if pd.isna(value) else f"{value:.0%}"


def _counted(row: Mapping[Any, Any]) -> str:
    """Which voxels of a model count as detected."""
    if row["voxels"] == WHOLE_TOWERS:
        return "the voxels of whole towers"
    return "the voxels at or above tau"


def _seeds(row: Mapping[Any, Any]) -> str:
    """Which trainings a row is of: ``all seeds``, or ``seed 3, best on validation``."""
    counted = str(row["counted"])
    return f"mean of {counted}" if counted == "all seeds" else counted


def _representative(models: pd.DataFrame, name: str) -> Mapping[Any, Any]:
    """The row of a model: its seed that is best on validation, or else the mean of all seeds."""
    rows = models[models["model"] == name]
    best = rows[rows["counted"].str.contains("best on validation", na=False)]
    return (best if len(best) else rows).iloc[0].to_dict()


def _kind(context: ReportContext, row: Mapping[Any, Any]) -> str:
    """The architecture and how it was trained, with the number of parameters."""
    size = row["parameters"]
    numbers = "" if size != size else f" with {write(size, 'count')} parameters"
    name = row["model"]
    if name == BOOSTED_TREES:
        return f"gradient boosted decision trees{numbers}"
    if context.results.models[name] == "cnn":
        return f"a convolutional network{numbers}"
    trained = context.results.of_model(name)[0]
    protocol = ((trained.provenance or {}).get("settings") or {}).get("protocol", "thesis")
    operational = protocol == "operational"
    how = "in metres, for practical use" if operational else "trained as in the thesis"
    return f"a SCENE-Net{numbers} {how}"
