"""The section on single test crops: where a model is right, and where it is wrong."""

from __future__ import annotations

from scenenet.figures import CROP_RANKS
from scenenet.report.blocks import Block, Column, Scene, Section, Text, table
from scenenet.report.context import VOXEL_SCORES, Material, beside

FINER_STUDY = "resolution-after-training"


def crops(material: Material) -> Section | None:
    """Figures 5.8 to 5.10."""
    blocks = [*_scenes(material), *material.figures("crops"), *_finer(material)]
    if not blocks:
        return None
    said = Text(
        "Three test crops chosen by rule: the one with the highest, the middle and the lowest F0.5."
    )
    return Section("crops", "Right and wrong", [said, *blocks])


def _finer(material: Material) -> list[Block]:
    """What a finer grid after training does to the scores (thesis 5.2.7)."""
    frame = material.table(f"study-{FINER_STUDY}")
    studied = [study for study in material.results.studies if study.name == FINER_STUDY]
    if frame is None or not studied:
        return []
    columns = [Column("variant", "grid"), *beside(VOXEL_SCORES)]
    caption = (
        f"The same over all {studied[0].part} crops: models trained at one resolution and scored "
        f"at others, mean ± standard deviation over {len(studied[0].seeds)} seeds (study "
        f"“{studied[0].title}”, thesis {studied[0].place})."
    )
    return [table(frame, columns, caption, f"tables/study-{FINER_STUDY}.csv")]


def _scenes(material: Material) -> list[Block]:
    """The crops that can be turned (thesis Figures 5.6, 5.8, 5.9)."""
    made: list[Block] = []
    for rank in CROP_RANKS:
        data = material.results.scene(rank)
        if data is None:
            continue
        geneos = [(name, f"part of the {name.replace('_', ' ')}") for name in data["shares"]]
        kinds = [
            ("found", "what reaches tau"),
            ("whole", "whole towers"),
            ("class", "class"),
            ("probability", "probability"),
        ]
        whole = data["whole_scores"]
        n = len(data["true"])
        made.append(
            Scene(
                rank,
                f"The {rank} test crop, to be turned",
                f"Crop {data['crop']} in voxels of {data['voxel_size']:.2f} m, as {data['model']} "
                f"(seed {data['seed']}) answers it. Drag to turn it, or use the arrow keys, + and "
                "-. What is found: green is right, orange is no tower, pink was missed. A part is "
                "red where an operator adds to the answer and blue where it takes away. The scores "
                f"count all voxels of the grid; the slider has {n - 1} thresholds. Whole towers, "
                f"found at the model's tau: precision {whole['precision']:.3f}, recall "
                f"{whole['recall']:.3f}, F0.5 {whole['f05']:.3f}.",
                f"The occupied voxels of crop {data['crop']} in space.",
                [*kinds, *geneos],
                data,
            )
        )
    return made
