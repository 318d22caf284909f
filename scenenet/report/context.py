"""The inputs of a section, and columns that several sections share.

A section is a function from ``ReportContext`` to a ``Section``, or to None if the run has no
results for it. ``scenenet.report.page`` has their order.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from urllib.parse import quote

import pandas as pd

from scenenet.experiments.published import Thesis
from scenenet.figures import Picture, plan, read_pictures
from scenenet.metrics.score_columns import PUBLISHED_SCORES, SCORE_COLUMNS, TRUTH
from scenenet.report.blocks import Block, Column, Figure, Section
from scenenet.results.folder import Results
from scenenet.results.result_files import read_table


@dataclass(frozen=True)
class ReportContext:
    """Everything that a section may show.

    Attributes:
        results: the result folder.
        thesis: published numbers.
        folder: of the page, for links to other files; None for no links.
        failed: new surveys that cannot be used -> why.
    """

    results: Results
    thesis: Thesis
    folder: Path | None = None
    failed: Mapping[str, str] = field(default_factory=dict)

    @cached_property
    def pictures(self) -> list[Picture]:
        """Every figure of the run that exists, in the order of the page."""
        names = [drawing.name for drawing in plan(self.results)]
        surveys = self.results.surveys
        maps = [f"{kind}-{survey}" for kind in ("labels", "clusters") for survey in surveys]
        return read_pictures(self.results.folder / "figures", [*maps, *names])

    def figures(self, section: str) -> list[Block]:
        """The figures of a section that do not belong to one survey."""
        return [Figure(p) for p in self.pictures if p.section == section and p.survey is None]

    def figures_of(self, survey: str, section: str) -> list[Block]:
        """The figures of one survey in a section."""
        return [Figure(p) for p in self.pictures if p.section == section and p.survey == survey]

    def table(self, name: str) -> pd.DataFrame | None:
        """The table ``tables/NAME.csv``; None if it does not exist or has no rows."""
        path = self.path(name)
        if not path.exists():
            return None
        frame = read_table(path)
        return None if frame.empty else frame

    def address(self, file: Path) -> str | None:
        """Where the page finds another file; None if there is no such file, or no links."""
        if self.folder is None or not file.exists():
            return None
        return quote(Path(os.path.relpath(file.resolve(), self.folder.resolve())).as_posix())

    def path(self, name: str) -> Path:
        """The file of a table."""
        return self.results.folder / "tables" / f"{name}.csv"


@dataclass(frozen=True)
class Against:
    """What scores are measured against.

    Attributes:
        prefix: beginning of the names of their columns.
        name: ``truth`` or ``labels``.
        adjective: of a tower: true or labelled.
    """

    prefix: str
    name: str
    adjective: str


AGAINST_TRUTH, AGAINST_LABELS = Against(TRUTH, "truth", "true"), Against("", "labels", "labelled")


def against(frame: pd.DataFrame, score: str) -> list[Against]:
    """What the scores of a table are measured against: first the truth, where it is known.

    Args:
        frame: with the columns ``truth_SCORE`` and ``SCORE``.
        score: the score that tells whether the truth is known.
    """
    known = f"{TRUTH}{score}" in frame and frame[f"{TRUTH}{score}"].notna().any()
    return [AGAINST_TRUTH, AGAINST_LABELS] if known else [AGAINST_LABELS]


def against_each(columns: Sequence[Column], measured: Sequence[Against]) -> list[Column]:
    """Columns for each of what they are measured against, which their headings name if it is more
    than the labels."""
    if len(measured) == 1:
        return list(columns)
    return [against_column(column, one, one.name) for one in measured for column in columns]


def against_column(column: Column, measured: Against, named: str = "") -> Column:
    """The column with the same score against something, which the heading names."""
    return replace(
        column,
        name=f"{measured.prefix}{column.name}",
        label=f"{column.label} ({named})" if named else column.label,
        spread=None if column.spread is None else f"{measured.prefix}{column.spread}",
    )


VOXEL_SCORES = [
    Column(column.name, column.label, "score2", f"{column.name}_std") for column in SCORE_COLUMNS
]


def with_published(columns: Sequence[Column]) -> list[Column]:
    """Each score, followed by the score of the thesis if there is one."""
    both = []
    for column in columns:
        both.append(column)
        if column.name in PUBLISHED_SCORES:
            name = f"thesis_{column.name}"
            both.append(Column(name, "thesis", "score2", f"{name}_std", published=True))
    return both


SectionMaker = Callable[[ReportContext], Section | None]
