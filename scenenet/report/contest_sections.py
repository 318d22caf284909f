"""Contests on the page: SCENE-Net and its rivals on the same crops."""

from __future__ import annotations

from scenenet.contests.noise_table import LABELS, claim, findings
from scenenet.report.blocks import Column, Facts, Notes, Section, Text, table
from scenenet.report.material import Material


def noise(material: Material) -> Section | None:
    """Thesis 5.2.5."""
    frame = material.table("noise")
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
        "noise",
        "Trained on wrong labels",
        [
            Text(text),
            Facts([("wrong tower points", f"{worst['share'].iloc[0]:.0%}"), *facts]),
            *material.figures("noise"),
            Notes("What each model makes of wrong labels", findings(frame)),
            table(shown, columns, caption, "tables/noise.csv", folded=True),
        ],
    )
