"""The sections on what is inside of a model: its numbers, what they promise (thesis 5.2.2, 3.4)."""

from __future__ import annotations

from scenenet.report.blocks import Block, Column, Facts, Heading, Section, Text, table
from scenenet.report.context import Material


def learned(material: Material) -> Section | None:
    """Figures 4.2-4.4 and 5.5."""
    blocks: list[Block] = [*_numbers(material), *material.figures("learned")]
    return Section("learned", "What was learned", blocks) if blocks else None


def _numbers(material: Material) -> list[Block]:
    """A table a model with every number in metres, and a sentence for each."""
    frame = material.table("parameters")
    if frame is None:
        return []
    blocks: list[Block] = []
    share = material.thesis.value("parameters.lambda_negative_sphere")
    ours = frame[frame["parameter"] == "lambda.negative_sphere"]
    if share is not None and len(ours):
        facts = [("λ of the negative sphere, thesis", f"{share:g} %")]
        facts += [(f"{row.model}", f"{100 * row.mean:.1f} %") for row in ours.itertuples()]
        blocks += [
            Facts(facts),
            Text(
                "In the thesis' model the negative sphere has the largest mixing weight (5.2.2). "
                "Weights of different runs are comparable only as far as the kernels have values "
                "of the same size."
            ),
        ]
    columns = [
        Column("parameter", "parameter"),
        Column("symbol", "symbol"),
        Column("mean", "trained", "number", "std"),
        Column("unit", "unit"),
        Column("initial", "at the start", "number"),
        Column("thesis", "thesis", "number", published=True),
        Column("sentence", "what it says", "sentence"),
    ]
    shown = frame.assign(
        parameter=frame["parameter"].str.replace("_", " ").str.replace(".", ": "),
        unit=frame["unit"].map({"m": "m", "m^2": "m²", "1": "none"}),
    )
    for model, rows in shown.groupby("model", sort=False):
        seeds = int(rows["n_seeds"].iloc[0])
        began = rows["initial_from"].iloc[0]
        start = f" “At the start” is the mean of the numbers {began}." if began == began else ""
        caption = (
            f"The numbers of {model}, mean ± standard deviation over {seeds} seeds, lengths in "
            "metres. The sentences follow from the kernels' formulas (thesis 4.4) and read the "
            f"mean.{start}"
        )
        blocks.append(table(rows, columns, caption, "tables/parameters.csv"))
    return blocks


def certificate(material: Material) -> Section | None:
    """What each model that predicts keeps of the promises of a GENEO (thesis 3.4, 4.3)."""
    frame = material.table("certificate")
    if frame is None:
        return None
    blocks: list[Block] = [
        Text(
            "A GENEO is equivariant (thesis Eq. 3.1) and non-expansive (Eq. 3.2), and a convex "
            "combination of GENEOs is one. These are statements about functions on space; a model "
            "works with kernels cut to a box of voxels. Here each is worked out and measured for "
            "the models as they predict."
        )
    ]
    columns = [
        Column("property", "property", "sentence"),
        Column("holds", "holds", "yes"),
        Column("found", "how far", "sentence"),
        Column("thesis", "thesis"),
    ]
    for model, rows in frame.groupby("model", sort=False):
        scene = (material.results.certificate(str(model)) or {}).get("scene", "a synthetic scene")
        if rows["kind"].iloc[0] == "cnn":
            said = (
                f"{model} is a convolution, which moves with the scene by construction. Its "
                "kernels are free numbers, so nothing else is promised."
            )
        else:
            said = f"Measured on {scene}, at the voxel size the model predicts with."
        caption = f"{model}, seed {rows['seed'].iloc[0]:.0f}. {said}"
        blocks += [
            Heading(f"{model}: {rows['holds'].sum()} of {len(rows)} properties hold"),
            table(rows, columns, caption, "tables/certificate.csv"),
        ]
    moved = material.table("certificate_turns")
    if moved is not None:
        columns = [
            Column("model", "model"),
            Column("degrees", "turned [°]", "number"),
            Column("mean_h", "H moves by", "score"),
            Column("mean_m", "M moves by", "score"),
            Column("largest_m", "M at most", "score"),
            Column("decided_otherwise", "decided otherwise", "score"),
        ]
        caption = (
            "The scene turned about z, and in the row without an angle shifted by half a voxel: "
            "mean difference of the observer H in its standard deviations, of the probability M, "
            "and the share of detections that are there either way but not both."
        )
        blocks.append(table(moved, columns, caption, "tables/certificate_turns.csv", folded=True))
    return Section("certificate", "What is certain about it", blocks)
