"""The section on single test crops: correct and wrong predictions in space."""

from __future__ import annotations

from scenenet.figures import CROP_RANKS
from scenenet.figures.interactive_crop import PALETTE
from scenenet.metrics.score_columns import score_text
from scenenet.report.blocks import Block, Column, Scene, Section, Text, table
from scenenet.report.context import VOXEL_SCORES, ReportContext, with_published

FINER_STUDY = "resolution-after-training"


def crops(context: ReportContext) -> Section | None:
    """Figures 5.8 to 5.10."""
    blocks = [*_scenes(context), *context.figures("crops"), *_finer(context)]
    if not blocks:
        return None
    rule = Text(
        "Three test crops, selected by rule: those with the highest, median and lowest F0.5 "
        "against the labels, with which the pictures compare."
    )
    return Section("crops", "Single crops", [rule, *blocks])


def _finer(context: ReportContext) -> list[Block]:
    """Scores on a finer grid than that of the training (thesis 5.2.7)."""
    frame = context.table(f"study-{FINER_STUDY}")
    studied = [study for study in context.results.studies if study.name == FINER_STUDY]
    if frame is None or not studied:
        return []
    columns = [Column("variant", "grid"), *with_published(VOXEL_SCORES)]
    caption = (
        f"All {studied[0].part} crops: models trained at one resolution and scored at others, "
        f"mean ± standard deviation over {len(studied[0].seeds)} seeds (study "
        f"“{studied[0].title}”, thesis {studied[0].place})."
    )
    return [table(frame, columns, caption, f"tables/study-{FINER_STUDY}.csv")]


def _scenes(context: ReportContext) -> list[Block]:
    """The interactive crops (thesis Figures 5.6, 5.8, 5.9)."""
    made: list[Block] = []
    for rank in CROP_RANKS:
        crop = context.results.interactive_crop(rank)
        if crop is None:
            continue
        geneos = [(name, f"contribution of the {name.replace('_', ' ')}") for name in crop.shares]
        kinds = [
            ("found", "voxels at or above tau"),
            ("whole", "whole towers"),
            ("class", "class"),
            ("probability", "probability"),
        ]
        whole = crop.whole_scores
        n = len(crop.true)
        made.append(
            Scene(
                rank,
                f"The {rank} test crop in 3D",
                f"Crop {crop.crop} in voxels of {crop.voxel_size:.2f} m, predicted by "
                f"{crop.model} (seed {crop.seed}). Drag to rotate, or use the arrow keys, + "
                "and -. Green: true positive; orange: false positive; pink: false negative. "
                "Contributions are red where a GENEO raises the output and blue where it lowers "
                "it. "
                f"Scores count all voxels of the grid; the slider has {n - 1} thresholds. Whole "
                f"towers at the tau of the model: precision {score_text(whole.precision, 3)}, "
                f"recall {score_text(whole.recall, 3)}, F0.5 {score_text(whole.f05, 3)}.",
                f"The occupied voxels of crop {crop.crop} in space.",
                [*kinds, *geneos],
                {**crop.to_json(), "palette": PALETTE},
            )
        )
    return made
