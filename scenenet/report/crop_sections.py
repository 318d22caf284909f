"""The section on single test crops: where a model is right, and where it is wrong."""

from __future__ import annotations

from scenenet.figures import CROP_RANKS
from scenenet.report.blocks import Block, Scene, Section, Text
from scenenet.report.material import Material


def crops(material: Material) -> Section | None:
    """Figures 5.8 and 5.9."""
    blocks = [*_scenes(material), *material.figures("crops")]
    if not blocks:
        return None
    said = Text(
        "Three test crops chosen by rule: the one with the highest, the middle and the lowest F0.5."
    )
    return Section("crops", "Right and wrong", [said, *blocks])


def _scenes(material: Material) -> list[Block]:
    """The crops that can be turned (thesis Figures 5.6, 5.8, 5.9)."""
    made: list[Block] = []
    for rank in CROP_RANKS:
        data = material.results.scene(rank)
        if data is None:
            continue
        geneos = [(name, f"part of the {name.replace('_', ' ')}") for name in data["shares"]]
        said = "what was found", "class", "probability"
        colourings = [*zip(("found", "class", "probability"), said, strict=True), *geneos]
        n = len(data["true"])
        made.append(
            Scene(
                rank,
                f"The {rank} test crop, to be turned",
                f"Crop {data['crop']} in voxels of {data['voxel_size']:.2f} m, as {data['model']} "
                f"(seed {data['seed']}) answers it. Drag to turn it, or use the arrow keys, + and "
                "-. Found: green is right, orange is no tower, pink was missed. A part is red "
                "where an operator adds to the answer and blue where it takes away. The scores "
                f"count all voxels of the grid; the slider has {n - 1} thresholds.",
                f"The occupied voxels of crop {data['crop']} in space.",
                colourings,
                data,
            )
        )
    return made
