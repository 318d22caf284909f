"""What a section may draw from, and columns that several sections share.

A section is a function from ``Material`` to a ``Section``, or to None where the run has nothing for
it. ``scenenet.report.page`` has the order of them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from scenenet.experiments.published import Thesis
from scenenet.figures import Picture, plan, read_pictures
from scenenet.report.blocks import Block, Column, Figure, Section
from scenenet.results.folder import Results, read_table

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Material:
    """All that a section may draw from."""

    results: Results
    thesis: Thesis

    @cached_property
    def pictures(self) -> list[Picture]:
        names = [drawing.name for drawing in plan(self.results)]
        surveys = self.results.surveys
        maps = [f"{kind}-{survey}" for kind in ("labels", "clusters") for survey in surveys]
        return read_pictures(self.results.folder / "figures", [*maps, *names])

    def figures(self, section: str) -> list[Block]:
        return [Figure(p) for p in self.pictures if p.section == section and p.survey is None]

    def figures_of(self, survey: str, section: str) -> list[Block]:
        return [Figure(p) for p in self.pictures if p.section == section and p.survey == survey]

    def table(self, name: str) -> pd.DataFrame | None:
        """A table as it was written; None if it is not there or has no rows."""
        path = self.path(name)
        if not path.exists():
            return None
        frame = read_table(path)
        return None if frame.empty else frame

    def path(self, name: str) -> Path:
        return self.results.folder / "tables" / f"{name}.csv"


def _scores(names: Sequence[tuple[str, str]]) -> list[Column]:
    return [Column(name, label, "score2", f"{name}_std") for name, label in names]


VOXEL_SCORES = _scores(
    [
        ("precision", "precision"),
        ("recall", "recall"),
        ("f05", "F0.5"),
        ("iou_tower", "IoU tower"),
        ("miou", "IoU mean"),
    ]
)


def beside(columns: Sequence[Column]) -> list[Column]:
    """Each score with the thesis' right behind it, where the thesis has it."""
    both = []
    for column in columns:
        both.append(column)
        if column.name in ("precision", "recall", "miou"):
            name = f"thesis_{column.name}"
            both.append(Column(name, "thesis", "score2", f"{name}_std", published=True))
    return both


SectionMaker = Callable[[Material], Section | None]
