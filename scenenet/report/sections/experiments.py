"""Contests on the page: SCENE-Net and its rivals on the same crops."""

from __future__ import annotations

from scenenet.experiments.label_noise.settings import LABELS
from scenenet.experiments.label_noise.summary import claim, findings
from scenenet.report.blocks import Column, Facts, Notes, Section, Text, table
from scenenet.report.context import Material


def cross_validation(material: Material) -> Section | None:
    """Where it was run, this says most about the models: every crop counts."""
    frame = material.table("cross_validation")
    if frame is None:
        return None
    columns = [
        Column("model", "model"),
        Column("live_share", "share alive", "score2"),
        Column("precision", "precision", "score", "precision_std"),
        Column("recall", "recall", "score", "recall_std"),
        Column("f05", "F0.5", "score", "f05_std"),
        Column("iou_tower", "IoU tower", "score", "iou_tower_std"),
        Column("pooled_f05", "F0.5 pooled", "score", "pooled_f05_std"),
        Column("worst_fold_f05", "F0.5, worst fold", "score"),
        Column("best_fold_f05", "best fold", "score"),
        Column("parameters", "parameters", "count"),
    ]
    first = frame.iloc[0]
    crops, n_folds, seeds = int(first["crops"]), int(first["n_folds"]), int(first["n_seeds"])
    ranked = frame.sort_values("f05", ascending=False)
    order = ", ".join(f"{row.model} {row.f05:.3f}" for row in ranked.itertuples())
    caption = (
        f"Each of {crops} crops is left out once, in {n_folds} fixed folds; numbers and tau are "
        f"chosen on the others. Mean over the folds ± standard deviation of it over {seeds} seeds; "
        "pooled: from the counts of all folds together. A voxel is a tower's where it reaches tau; "
        "in the rows of whole towers, where it belongs to a tower that is found, body and all, by "
        "the same rules for every model (docs/method/detection.md)."
    )
    text = (
        f"The main result: {crops} crops are few, so each of them is a test crop once and no score "
        f"hangs on one split. F0.5 of the tower class, best first: {order}."
    )
    return Section(
        "cross-validation",
        "Main result: every crop a test crop once",
        [
            Text(text),
            Facts([(f"F0.5, {row.model}", f"{row.f05:.3f}") for row in ranked.itertuples()]),
            *material.figures("cross_validation"),
            table(frame, columns, caption, "tables/cross_validation.csv"),
        ],
    )


def noise(material: Material) -> Section | None:
    """Thesis 5.2.5."""
    frame = material.table("label_noise")
    if frame is None:
        return None
    worst = frame[frame["level"] == frame["level"].max()]
    facts = [
        (f"F0.5 of {row.model} against the truth", f"{row.truth_f05:.2f}")
        for row in worst.itertuples()
    ]
    columns = [
        Column("share_percent", "wrong tower points [%]", "share"),
        Column("model", "model"),
        Column("live_share", "share alive", "score2"),
        *(
            Column(f"{against}_{name}", f"{label} ({against})", "score2", f"{against}_{name}_std")
            for against in ("labels", "truth")
            for name, label in (("precision", "P"), ("recall", "R"), ("f05", "F0.5"))
        ),
        Column("gain", "F0.5 more than its labels", "score2", "gain_std"),
        Column("better_seeds", "seeds with more", "count"),
        Column("wrong_detected", "wrong voxels detected", "score2", "wrong_detected_std"),
    ]
    seeds = int(frame["n_seeds"].max())
    caption = (
        "Scores of the tower class on towers that no model was trained or tuned on, against labels "
        f"as wrong as those it learnt from and against the truth, mean ± standard deviation over "
        f"{seeds} seeds with a synthetic line each. The share of wrong points is measured. "
        f"“{LABELS}” are scored as if they were an answer. Thesis 5.2.5."
    )
    text = (
        "The thesis holds that SCENE-Net recovers the body of a tower although half of the labels "
        f"are wrong. {claim(frame, material.results.models)}"
    )
    shown = frame.assign(share_percent=100 * frame["share"])
    return Section(
        "label_noise",
        "Trained on wrong labels",
        [
            Text(text),
            Facts([("wrong tower points", f"{worst['share'].iloc[0]:.0%}"), *facts]),
            *material.figures("label_noise"),
            Notes("What each model makes of wrong labels", findings(frame)),
            table(shown, columns, caption, "tables/label_noise.csv", folded=True),
        ],
    )
