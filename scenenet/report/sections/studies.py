"""The studies (thesis 5.2.7, 5.3)."""

from __future__ import annotations

from scenenet.experiments.studies.findings import findings
from scenenet.report.blocks import Block, Column, Figure, Heading, Section, Text, table
from scenenet.report.context import VOXEL_SCORES, ReportContext, with_published

NEGATIVE = (
    Column("negative_share", "share of seeds with a negative parameter", "score2"),
    Column("lowest_weight", "lowest weight", "score"),
    Column("lowest_shape", "lowest shape parameter", "score"),
)
"""Whether the model is convex after training (thesis 5.3.3); shown if any model is not."""


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
            Column("training_crops", "training crops", "count"),
            Column("scored_crops", "crops scored", "count"),
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
