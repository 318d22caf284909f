"""The studies on the page, and every published number beside ours (thesis 5.2.7, 5.3)."""

from __future__ import annotations

from scenenet.experiments.studies.findings import findings
from scenenet.report.blocks import Block, Column, Facts, Figure, Heading, Section, Text, table
from scenenet.report.context import VOXEL_SCORES, Material, beside
from scenenet.results.thesis_comparison import (
    BETTER,
    NOT,
    REPRODUCED,
    SCORE_TOLERANCE,
    TOLERANCE,
    UNMEASURED,
)

NEGATIVE = (
    Column("negative_share", "seeds with a negative number", "score2"),
    Column("lowest_weight", "lowest weight", "score"),
    Column("lowest_shape", "lowest shape parameter", "score"),
)
"""How convex a model is left (thesis 5.3.3), where any is left otherwise."""
VERDICTS = (REPRODUCED, BETTER, NOT, UNMEASURED)


def studies(material: Material) -> Section | None:
    """Every study that was run."""
    pictures = {picture.name: picture for picture in material.pictures}
    blocks: list[Block] = []
    for study in material.results.studies:
        frame = material.table(f"study-{study.name}")
        if frame is None:
            continue
        columns = [
            Column("variant", study.title.lower()),
            Column("alive", f"alive of {len(study.seeds)}", "count"),
            *beside(VOXEL_SCORES),
            Column("parameters", "parameters", "count"),
            *(NEGATIVE if frame["negative_share"].max() > 0 else ()),
            Column("training_crops", "crops", "count"),
            Column("training_seconds", "training", "seconds"),
        ]
        caption = (
            f"Scores on the {study.part} crops, mean ± standard deviation over "
            f"{len(study.seeds)} seeds. Thesis {study.place}."
        )
        said = f" The thesis: {study.thesis_says}" if study.thesis_says else ""
        found = findings(study, frame)
        blocks += [Heading(study.title), Text(study.asks), Text(f"{found}{said}")]
        if picture := pictures.get(f"study-{study.name}"):
            blocks.append(Figure(picture))
        source = f"tables/study-{study.name}.csv"
        blocks.append(table(frame, columns, caption, source, folded=True))
    return Section("studies", "What it depends on", blocks) if blocks else None


def thesis_and_ours(material: Material) -> Section | None:
    """Every number of ``config/thesis.yaml`` with ours and a verdict."""
    frame = material.table("thesis_and_ours")
    if frame is None:
        return None
    counts = frame["verdict"].value_counts()
    facts = [(verdict, str(counts.get(verdict, 0))) for verdict in VERDICTS]
    columns = [
        Column("place", "thesis"),
        Column("what", "number"),
        Column("thesis", "published", "number", "spread", published=True),
        Column("low", "from", "number", published=True),
        Column("high", "to", "number", published=True),
        Column("ours", "ours", "number"),
        Column("unit", "unit"),
        Column("verdict", "verdict"),
        Column("remark", "why"),
    ]
    caption = (
        f"Every published number. {REPRODUCED}: inside the published range, within "
        f"{SCORE_TOLERANCE:g} for a score, within {TOLERANCE:.0%} for anything else. {BETTER}: a "
        "higher score or a shorter time than that. The first model of each architecture speaks for "
        "it, with its mean over all seeds."
    )
    shown = frame.fillna({"unit": "", "remark": ""})
    found = table(shown, columns, caption, "tables/thesis_and_ours.csv", folded=True)
    return Section("thesis", "Thesis and ours", [Facts(facts), found])
