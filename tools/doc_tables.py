"""Write the tables in the documentation that follow from the code: ``python tools/doc_tables.py``.

A table stands in a page between ``<!-- NAME -->`` and ``<!-- end -->``; a test compares it with the
code. ``tools/doc_figures.py`` writes the tables of measured figures in the same way.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from importlib import import_module
from pathlib import Path

DOCS = Path(__file__).resolve().parent.parent / "docs"


def columns_of(module: str, columns: str) -> Callable[[], str]:
    """Makes the table of every column of a list.

    Args:
        module: that declares them.
        columns: their name in it.
    """

    def table() -> str:
        declared = getattr(import_module(module), columns)
        return _table("column", ((c.name, c.unit, c.description) for c in declared))

    return table


def class_schemes() -> str:
    """Every class scheme."""
    from scenenet.pointcloud.class_schemes import markdown

    return markdown()


def targets() -> str:
    """Every name of a target, with its codes in each class scheme."""
    from scenenet.pointcloud.targets import markdown

    return markdown()


def measurements() -> str:
    """Every measurement of the package."""
    from scenenet.core.provided_code import MEASUREMENTS
    from scenenet.measurement import measurement_named
    from scenenet.pointcloud.point_fields import TITLES

    lines = ["| measurement | phi of a voxel | the file must have |", "|---|---|---|"]
    for name in sorted(MEASUREMENTS.built_in()):
        measurement = measurement_named(name)
        said = " ".join((measurement.__doc__ or "").split()).removeprefix("phi = ").rstrip(".")
        lines.append(f"| `{name}` | {said} | {', '.join(TITLES[f] for f in measurement.fields)} |")
    return "\n".join(lines)


def scores() -> str:
    """Every score that the tables report."""
    from scenenet.metrics.score_columns import SCORE_COLUMNS

    return _table("name", ((c.name, c.unit, c.description) for c in SCORE_COLUMNS))


TABLES: Mapping[str, Callable[[], str]] = {
    "class schemes": class_schemes,
    "targets": targets,
    "measurements": measurements,
    "scores": scores,
    "tower list": columns_of("scenenet.detection.survey_tower", "TOWER_COLUMNS"),
    "spans": columns_of("scenenet.line.records", "SPAN_COLUMNS"),
    "conductors": columns_of("scenenet.line.records", "CONDUCTOR_COLUMNS"),
    "supports": columns_of("scenenet.line.records", "SUPPORT_COLUMNS"),
    "line notes": columns_of("scenenet.line.notes", "NOTE_COLUMNS"),
    "clearances by span": columns_of("scenenet.clearance.records", "SPAN_CLEARANCE_COLUMNS"),
    "clearances": columns_of("scenenet.clearance.records", "CLEARANCE_COLUMNS"),
    "fall trees": columns_of("scenenet.clearance.records", "TREE_COLUMNS"),
    "clearance profile": columns_of("scenenet.clearance.records", "PROFILE_COLUMNS"),
}
"""What stands in the first comment -> the table."""


def tables_in(text: str) -> dict[str, str]:
    """Name -> table of the generated tables in a page."""
    return dict(re.findall(r"<!-- (?!end)([a-z ]+) -->\n(.*?)\n<!-- end -->", text, re.DOTALL))


def with_tables(text: str, tables: Mapping[str, Callable[[], str]] = TABLES) -> str:
    """A page with those of its tables that are in ``tables`` made again."""
    for name, old in tables_in(text).items():
        if name in tables:
            start = f"<!-- {name} -->\n"
            text = text.replace(f"{start}{old}", f"{start}{tables[name]()}")
    return text


def _table(first: str, rows: Iterable[tuple[str, str, str]]) -> str:
    lines = [f"| `{name}` | {unit} | {meaning} |" for name, unit, meaning in rows]
    return "\n".join([f"| {first} | unit | meaning |", "|---|---|---|", *lines])


def main() -> None:
    for page in DOCS.rglob("*.md"):
        text = page.read_text(encoding="utf-8")
        page.write_text(with_tables(text), encoding="utf-8")


if __name__ == "__main__":
    main()
