"""The experiments in the report (thesis 5.2.4, 5.2.5)."""

from __future__ import annotations

from scenenet.experiments.components.summary import COUNTED
from scenenet.experiments.cross_validation.summary import case_name
from scenenet.experiments.label_noise.settings import AGAINST, LABELS
from scenenet.experiments.label_noise.summary import findings
from scenenet.experiments.registry import EXPERIMENTS
from scenenet.metrics.score_columns import DECISIVE, SCORE_COLUMNS, score_text
from scenenet.report.blocks import Column, Facts, Notes, Section, Text, table
from scenenet.report.context import ReportContext, against, against_each

TOWER_SCORES = [column for column in SCORE_COLUMNS if column.tower_only]


def cross_validation(context: ReportContext) -> Section | None:
    """The main result if it was run, because every crop counts."""
    experiment = EXPERIMENTS["cross_validation"]
    frame = context.table(experiment.name)
    if frame is None:
        return None
    measured = against(frame, "f05")
    scores = [
        *(Column(c.name, c.label, "score", f"{c.name}_std") for c in TOWER_SCORES),
        Column("pooled_f05", "F0.5, pooled", "score", "pooled_f05_std"),
        Column("worst_fold_f05", "F0.5, worst fold", "score"),
        Column("best_fold_f05", "F0.5, best fold", "score"),
    ]
    columns = [
        Column("model", "model"),
        Column("voxels", "voxels that count"),
        Column("live_share", "share of live models", "score2"),
        *against_each(scores, measured),
        Column("parameters", "parameters", "count"),
    ]
    first = frame.iloc[0]
    crops, n_folds, seeds = int(first["crops"]), int(first["n_folds"]), int(first["n_seeds"])
    caption = (
        f"Each of {crops} crops is left out once, in {n_folds} fixed folds; models are trained and "
        "tau is chosen on the labels of the others. Mean over the folds ± its standard deviation "
        f"over {seeds} seeds. Pooled: from the counts of all folds together. “At or above tau”: "
        "every voxel whose probability reaches the threshold counts as detected. “Whole towers”: "
        "every voxel with a point of a tower that was found counts as detected, by the same rules "
        "for every model (docs/method/detection.md)."
    )
    text = (
        f"Main result: with only {crops} crops, each of them is a test crop once, so that no score "
        "depends on a single split. "
        f"{experiment.finding(frame, context.results.models)}"
    )
    decisive = f"{measured[0].prefix}f05"
    facts = [
        (f"F0.5, {case_name(row['model'], row['voxels'])}", score_text(row[decisive], 3))
        for row in frame.sort_values(decisive, ascending=False).to_dict("records")
    ]
    return Section(
        "cross-validation",
        f"Main result: {experiment.title.lower()}",
        [
            Text(text),
            Facts(facts),
            *context.figures(experiment.name),
            table(frame, columns, caption, f"tables/{experiment.name}.csv"),
        ],
    )


def components(context: ReportContext) -> Section | None:
    """Rules alone, models alone, and both."""
    experiment = EXPERIMENTS["components"]
    frame = context.table(experiment.name)
    if frame is None:
        return None
    measured = against(frame, "point_f05")
    scores = [
        Column(f"{what}_{c.name}{end}", f"{c.short} of {what}s{worst}", "score2")
        for what in COUNTED
        for c in TOWER_SCORES
        for end, worst in (("", ""), ("_worst", ", worst"))
        if not end or c.name == DECISIVE
    ]
    numbers = [
        Column("towers", "towers", "count"),
        Column("towers_found", "found", "number"),
        Column("towers_found_worst", "found, worst", "number"),
        Column("towers_false", "false", "number"),
        Column("towers_false_worst", "false, worst", "number"),
    ]
    columns = [
        Column("model", "source"),
        Column("rules", "rules"),
        Column("n_seeds", "seeds", "count"),
        *against_each([*scores, *numbers], measured),
        Column("parameters", "parameters", "count"),
    ]
    crops, seeds = int(frame["crops"].max()), int(frame["n_seeds"].max())
    caption = (
        f"{crops} test crops; models and tau know the other crops alone. Mean over {seeds} seeds "
        "where something is drawn, and the worst seed. “Without rules”: voxels at or above tau, "
        "the points in them, and a tower for each group of voxels that touch. “With rules”: the "
        "answer of scenenet predict for the crop. “Rules alone”: every occupied voxel is a "
        "candidate. “Shape priors”: scenenet.baselines.shape_priors, without training."
    )
    return Section(
        experiment.name,
        experiment.title,
        [
            Text(experiment.finding(frame, context.results.models)),
            *context.figures(experiment.name),
            table(frame, columns, caption, f"tables/{experiment.name}.csv"),
        ],
    )


def label_noise(context: ReportContext) -> Section | None:
    """Training on labels of which a known share is wrong (thesis 5.2.5)."""
    experiment = EXPERIMENTS["label_noise"]
    frame = context.table(experiment.name)
    if frame is None:
        return None
    worst = frame[frame["level"] == frame["level"].max()]
    facts = [
        (f"F0.5 of {row.model} against the truth", score_text(row.truth_f05))
        for row in worst.itertuples()
    ]
    scores = [
        Column(f"{against}_{c.name}", f"{c.short} ({against})", "score2", f"{against}_{c.name}_std")
        for against in AGAINST
        for c in TOWER_SCORES
    ]
    columns = [
        Column("share_percent", "wrong tower points [%]", "share"),
        Column("model", "model"),
        Column("live_share", "share of live models", "score2"),
        *scores,
        Column("gain", "F0.5 minus that of the labels", "score2", "gain_std"),
        Column("better_seeds", "seeds above the labels", "count"),
        Column("wrong_detected", "wrong voxels detected", "score2", "wrong_detected_std"),
    ]
    seeds = int(frame["n_seeds"].max())
    caption = (
        "Scores of the tower class on test towers that no model was trained or tuned on, compared "
        "with labels of the same quality as the training labels and with the truth. Mean ± "
        "standard "
        f"deviation over {seeds} seeds, each with its own synthetic line. The share of wrong tower "
        f"points is measured. The row “{LABELS}” scores the labels as if a model had predicted "
        f"them. Thesis {experiment.place}."
    )
    text = (
        "The thesis states that SCENE-Net recovers the body of a tower although half of the labels "
        f"are wrong. {experiment.finding(frame, context.results.models)}"
    )
    shown = frame.assign(share_percent=100 * frame["share"])
    source = f"tables/{experiment.name}.csv"
    return Section(
        experiment.name,
        experiment.title,
        [
            Text(text),
            Facts([("wrong tower points", f"{worst['share'].iloc[0]:.0%}"), *facts]),
            *context.figures(experiment.name),
            Notes("Scores of each model over the levels of noise", findings(frame)),
            table(shown, columns, caption, source, folded=True),
        ],
    )


EXPERIMENT_SECTIONS = {
    "cross_validation": cross_validation,
    "components": components,
    "label_noise": label_noise,
}
"""The section of each experiment of ``scenenet.experiments.registry``."""
