"""The studies, and every published number with the number of this run (thesis 5.2.7, 5.3)."""

from __future__ import annotations

import pandas as pd

from scenenet.experiments.studies.findings import findings
from scenenet.report.blocks import Block, Column, Facts, Figure, Heading, Section, Text, table
from scenenet.report.context import VOXEL_SCORES, ReportContext, with_published
from scenenet.results.thesis_comparison import (
    BETTER,
    NOT,
    REPRODUCED,
    SCORE_TOLERANCE,
    TOLERANCE,
    UNMEASURED,
)

NEGATIVE = (
    Column("negative_share", "share of seeds with a negative parameter", "score2"),
    Column("lowest_weight", "lowest weight", "score"),
    Column("lowest_shape", "lowest shape parameter", "score"),
)
"""Whether the model is convex after training (thesis 5.3.3); shown if any model is not."""
VERDICTS = (REPRODUCED, BETTER, NOT, UNMEASURED)


def studies(context: ReportContext) -> Section | None:
    """Every study that was run."""
    pictures = {picture.name: picture for picture in context.pictures}
    blocks: list[Block] = []
    for study in context.results.studies:
        frame = context.table(f"study-{study.name}")
        if frame is None:
            continue
        columns = [
            Column("variant", study.title.lower()),
            Column("alive", f"live of {len(study.seeds)}", "count"),
            *with_published(VOXEL_SCORES),
            Column("parameters", "parameters", "count"),
            *(NEGATIVE if frame["negative_share"].max() > 0 else ()),
            Column("training_crops", "crops", "count"),
        ]
        caption = (
            f"Scores on the {study.part} crops, mean ± standard deviation over "
            f"{len(study.seeds)} seeds. Thesis {study.place}."
        )
        thesis = f" Thesis: {study.thesis_says}" if study.thesis_says else ""
        found = findings(study, frame)
        blocks += [Heading(study.title), Text(study.asks), Text(f"{found}{thesis}")]
        if picture := pictures.get(f"study-{study.name}"):
            blocks.append(Figure(picture))
        source = f"tables/study-{study.name}.csv"
        blocks.append(table(frame, columns, caption, source, folded=True))
    return Section("studies", "Studies", blocks) if blocks else None


def thesis_and_ours(context: ReportContext) -> Section | None:
    """Every number of ``config/thesis.yaml`` with the number of this run and a verdict."""
    frame = context.table("thesis_and_ours")
    if frame is None:
        return None
    times = context.table("thesis_and_ours_times")
    if times is not None:
        frame = pd.concat([frame, times], ignore_index=True)
    counts = frame["verdict"].value_counts()
    facts = [(verdict, str(counts.get(verdict, 0))) for verdict in VERDICTS]
    columns = [
        Column("place", "thesis"),
        Column("what", "number"),
        Column("thesis", "published", "number", "spread", published=True),
        Column("low", "from", "number", published=True),
        Column("high", "to", "number", published=True),
        Column("ours", "this run", "number"),
        Column("unit", "unit"),
        Column("verdict", "verdict"),
        Column("remark", "remark"),
    ]
    caption = (
        f"Every published number. {REPRODUCED}: within the published range, within "
        f"{SCORE_TOLERANCE:g} for a score, or within {TOLERANCE:.0%} for other numbers. {BETTER}: "
        "a higher score or a shorter time. Each architecture is represented by its first model, "
        "with the mean over all seeds."
    )
    shown = frame.fillna({"unit": "", "remark": ""})
    source = "tables/thesis_and_ours.csv, tables/thesis_and_ours_times.csv"
    found = table(shown, columns, caption, source, folded=True)
    return Section("thesis", "Thesis and this run", [Facts(facts), found])
