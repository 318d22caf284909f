"""The studies on the page: a question, a picture and a table each (thesis 5.2.7, 5.3)."""

from __future__ import annotations

from scenenet.report.blocks import Block, Column, Figure, Heading, Section, Text, table
from scenenet.report.sections import VOXEL_SCORES, Material, beside


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
            Column("live_share", "share alive", "score2"),
            *beside(VOXEL_SCORES),
            Column("parameters", "parameters", "count"),
            Column("training_crops", "crops", "count"),
            Column("training_seconds", "training", "seconds"),
        ]
        caption = (
            f"Scores on the {study.part} crops, mean ± standard deviation over "
            f"{len(study.seeds)} seeds. Thesis {study.place}."
        )
        blocks += [Heading(study.title), Text(study.asks)]
        if picture := pictures.get(f"study-{study.name}"):
            blocks.append(Figure(picture))
        source = f"tables/study-{study.name}.csv"
        blocks.append(table(frame, columns, caption, source, folded=True))
    return Section("studies", "What it depends on", blocks) if blocks else None
