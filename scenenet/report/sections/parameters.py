"""The sections on the inside of a model: parameters and verified properties (thesis 5.2.2, 3.4)."""

from __future__ import annotations

import pandas as pd

from scenenet.report.blocks import Block, Column, Facts, Heading, Section, Text, table
from scenenet.report.context import ReportContext

COLUMNS = [
    Column("parameter", "parameter"),
    Column("symbol", "symbol"),
    Column("mean", "trained", "number", "std"),
    Column("unit", "unit"),
    Column("initial", "initial", "number"),
    Column("thesis", "thesis", "number", published=True),
]
EVIDENCE = [
    Column("source", "comes from"),
    Column("low", "lowest", "number"),
    Column("high", "highest", "number"),
    Column("bound_met", "seeds at a bound", "score"),
    Column("determined", "determined", "yes"),
]
MEANING = Column("sentence", "meaning", "sentence")


def learned(context: ReportContext) -> Section | None:
    """Figures 4.2-4.4 and 5.5."""
    blocks: list[Block] = [*_numbers(context), *context.figures("learned")]
    return Section("learned", "Learned parameters", blocks) if blocks else None


def _numbers(context: ReportContext) -> list[Block]:
    """A table per model with every parameter in metres and a sentence for each."""
    frame = context.table("parameters")
    if frame is None:
        return []
    shown = frame.assign(
        parameter=frame["parameter"].str.replace("_", " ").str.replace(".", ": "),
        unit=frame["unit"].map({"m": "m", "m^2": "m²", "1": "none"}),
    )
    tables = [_of_model(str(model), rows) for model, rows in shown.groupby("model", sort=False)]
    return [*_mixing_weights(context, frame), *tables]


def _mixing_weights(context: ReportContext, frame: pd.DataFrame) -> list[Block]:
    """The mixing weight of the negative sphere, beside that of the thesis."""
    share = context.thesis.value("parameters.lambda_negative_sphere")
    ours = frame[frame["parameter"] == "lambda.negative_sphere"]
    if share is None or not len(ours):
        return []
    facts = [("mixing weight of the negative sphere, thesis", f"{share:g} %")]
    facts += [(f"the same, {row.model}", f"{100 * row.mean:.1f} %") for row in ours.itertuples()]
    return [
        Facts(facts),
        Text(
            "In the model of the thesis, the negative sphere has the largest mixing weight "
            "(5.2.2). The weights of two runs can be compared only if the values of their kernels "
            "are of similar size."
        ),
    ]


def _of_model(model: str, rows: pd.DataFrame) -> Block:
    """The parameters of a model, with what the training data say about each if that is known."""
    seeds = int(rows["n_seeds"].iloc[0])
    began = rows["initial_from"].iloc[0]
    start = f" “Initial” is the mean of the values {began}." if began == began else ""
    caption = (
        f"Parameters of {model}, mean ± standard deviation over {seeds} seeds, lengths in "
        "metres. The sentences are derived from the formulas of the kernels (thesis 4.4) with "
        f"the mean values.{start}"
    )
    with_evidence = rows["source"].notna().any()
    if with_evidence:
        caption += (
            " “Lowest” and “highest” are the values that the training data allow: two standard "
            "errors around a measurement in points, or F0.5 within 0.01 of the best with the "
            "other numbers kept. Numbers that the data do not determine have no sentence."
        )
    listed = [*COLUMNS, *(EVIDENCE if with_evidence else []), MEANING]
    return table(rows, listed, caption, "tables/parameters.csv")


def certificate(context: ReportContext) -> Section | None:
    """Which properties of a GENEO each model has (thesis 3.4, 4.3)."""
    frame = context.table("certificate")
    if frame is None:
        return None
    blocks: list[Block] = [
        Text(
            "A GENEO is equivariant (thesis Eq. 3.1) and non-expansive (Eq. 3.2), and a convex "
            "combination of GENEOs is a GENEO. These are statements about functions on continuous "
            "space, while a model uses kernels that are cut to a box of voxels. This section "
            "verifies each property by calculation and by measurement for the models as they are "
            "used."
        )
    ]
    columns = [
        Column("property", "property", "sentence"),
        Column("holds", "holds", "yes"),
        Column("found", "result", "sentence"),
        Column("thesis", "thesis"),
    ]
    for model, rows in frame.groupby("model", sort=False):
        known = context.results.certificate(str(model))
        scene = "a synthetic scene" if known is None else known.scene
        if rows["kind"].iloc[0] == "cnn":
            basis = (
                f"{model} is a convolution, so it is equivariant under translation by "
                f"construction. Its kernels are unconstrained, so no other property is guaranteed."
            )
        else:
            basis = f"Measured on {scene}, at the voxel size that the model uses."
        caption = f"{model}, seed {rows['seed'].iloc[0]:.0f}. {basis}"
        blocks += [
            Heading(f"{model}: {rows['holds'].sum()} of {len(rows)} properties hold"),
            table(rows, columns, caption, "tables/certificate.csv"),
        ]
    moved = context.table("certificate_turns")
    if moved is not None:
        columns = [
            Column("model", "model"),
            Column("degrees", "rotation [°]", "number"),
            Column("mean_h", "mean change of H", "score"),
            Column("mean_m", "mean change of M", "score"),
            Column("largest_m", "largest change of M", "score"),
            Column("decision_changed", "share of detections that differ", "score"),
        ]
        caption = (
            "Change of the output when the scene is rotated about z or, in the row without an "
            "angle, shifted by half a voxel: mean difference of the observer H in its standard "
            "deviations, of the probability M, and the share of detections that are present in one "
            "of the two scenes only."
        )
        blocks.append(table(moved, columns, caption, "tables/certificate_turns.csv", folded=True))
    return Section("certificate", "Verified properties", blocks)
