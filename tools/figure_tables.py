"""The tables of figures in README and docs, from the results of the kept runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple

import pandas as pd
from kept_runs import FIGURES, Figures, Values, made_on

from scenenet.core.errors import InputError
from scenenet.experiments.components.settings import PUBLISHED, WITH, WITHOUT
from scenenet.experiments.components.summary import COUNTED
from scenenet.metrics.score_columns import TRUTH

Row = Mapping[str, Any]
PROPERTY = {"property": "property", "unit": "unit"}
RANGE = {"lowest": "lowest", "highest": "highest"}
THESIS = {"thesis_lowest": "thesis: lowest", "thesis_highest": "highest"}
DATASET = PROPERTY | {"value": "value"} | RANGE | {"thesis": "thesis"} | THESIS
LABELLED = PROPERTY | {"mean": "mean"} | RANGE | {"thesis_mean": "thesis"} | THESIS
CLASSES = {"code": "code", "class": "class", "share_percent": "%", "thesis_percent": "thesis, %"}
"""Columns of the tables of a dataset -> their headings."""
MODELS = {"model": "model", "counted": "counted", "live_share": "live", "precision": "precision",
          "precision_std": "±", "recall": "recall", "recall_std": "±", "f05": "F0.5",
          "iou_tower": "IoU of towers", "truth_f05": "F0.5, truth",
          "thesis_precision": "thesis: precision", "thesis_recall": "recall"}  # fmt: skip
VERDICTS = {"place": "thesis", "claim": "claim", "verdict": "verdict", "statistic": "statistic",
            "value": "value", "low": "95 % from", "high": "to"}  # fmt: skip
PUBLISHED_RUNS = {"variant": "parameters", "seed": "seed", "precision": "precision",
                  "recall": "recall", "f05": "F0.5"}  # fmt: skip
"""Columns of the tables of a run at the scale of the thesis -> their headings."""
SHORT = ("rules alone", "published weights", "boosted trees", "scenenet-operational")
"""Sources of the table in README: no model, no training, the strongest baseline, and the model of
the package."""
LINE_ERRORS = ("error", "height_error", "base_error")


class Table(NamedTuple):
    """A table of figures.

    Attributes:
        runs: those that it shows.
        make: its text.
    """

    runs: tuple[str, ...]
    make: Callable[[], str]


def accuracy_table(values: Values, figures: Figures, run: str, against: str) -> str:
    """Every source of a run of the experiment `components`, on points, voxels and towers."""
    head = "source | rules | points: P, R | F0.5 | IoU | voxels: P, R | F0.5 | IoU"
    lines = [f"| {head} | towers found / false |", "|---" * 9 + "|"]
    for row in sorted(values.rows(run, "components"), key=partial(_order, figures)):
        if pd.notna(row[f"{against}point_f05"]):
            cells = _case(figures, row)
            for what in COUNTED:
                column = f"{against}{what}_"
                cells += [_p_r(row, column), _f05(row, column), f"{row[f'{column}iou_tower']:.2f}"]
            lines.append(f"| {' | '.join([*cells, _towers(row, against)])} |")
    return "\n".join([*lines, "", _of_run(values, figures, run)])


def short_table(values: Values, figures: Figures, runs: Mapping[str, str]) -> str:
    """Points and towers of several runs beside each other, of the sources in ``SHORT`` with rules.

    Args:
        values: of the kept runs.
        figures: ``docs/figures.yaml``.
        runs: name -> beginning of the columns to show.
    """
    head = "| source | rules |"
    cases: dict[tuple[int, bool], dict[str, Row]] = {}
    for run, against in runs.items():
        rows = values.rows(run, "components")
        there = max(row[f"{against}towers"] for row in rows if row["rules"] == WITH)
        title = figures.runs[run].title
        head += f" {title}: points P, R | F0.5 | found / false of {there:.0f} |"
        for row in sorted(rows, key=partial(_order, figures)):
            chosen = row["model"] in SHORT and row["rules"] == WITH
            if chosen and pd.notna(row[f"{against}point_f05"]):
                cases.setdefault(_order(figures, row), {})[run] = row
    lines = [head, "|---" * (2 + 3 * len(runs)) + "|"]
    for _, of_runs in sorted(cases.items()):
        cells = _case(figures, next(iter(of_runs.values())))
        for run, against in runs.items():
            if run not in of_runs:
                cells += ["", "", ""]
                continue
            measured, column = of_runs[run], f"{against}point_"
            cells += [_p_r(measured, column), _f05(measured, column), _towers(measured, against)]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join([*lines, "", " ".join(_of_run(values, figures, run) for run in runs)])


def towers_table(values: Values, run: str, first: str, against: str) -> str:
    """Towers and their points, a row for each file that was evaluated.

    Args:
        values: of the kept runs.
        run: its name; its kept file has the same name.
        first: heading of the first column.
        against: ``TRUTH`` or empty for the labels.
    """
    head = f"{first} | found / towers | false | precision of points | recall | IoU"
    lines = [f"| {head} | position, m | height, m | base, m |", "|---" * 9 + "|"]
    prefix = "truth." if against == TRUTH else ""
    for row in sorted(values.rows(run, run), key=_number_or_name):
        towers, points = f"{prefix}towers.", f"{prefix}points."
        there = row[f"{towers}n_true"]
        found = round((_or_zero(row[f"{towers}recall"])) * there)
        cells = [str(row["file"]), f"{found} / {there}", str(row[f"{towers}n_predicted"] - found)]
        cells += _points(row, points)
        cells += [_two(row[f"{towers}median_{name}_m"]) for name in LINE_ERRORS]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def points_table(values: Values, run: str, first: str) -> str:
    """Points against the labels, a row for each file that was evaluated; arguments as
    ``towers_table``."""
    lines = [f"| {first} | precision of points | recall | IoU |", "|---" * 4 + "|"]
    for row in sorted(values.rows(run, run), key=_number_or_name):
        lines.append(f"| {' | '.join([str(row['file']), *_points(row, 'points.')])} |")
    return "\n".join(lines)


def _points(row: Row, points: str) -> list[str]:
    """Precision, recall and IoU of points, whose columns begin with ``points``."""
    return [_two(row[points + name]) for name in ("precision", "recall", "iou")]


def _number_or_name(row: Row) -> tuple[bool, int, str]:
    name = str(row["file"])
    return not name.isdigit(), int(name) if name.isdigit() else 0, name


def _two(value: float) -> str:
    return "" if pd.isna(value) else f"{value:.2f}"


def _or_zero(value: float) -> float:
    return 0.0 if pd.isna(value) else value


def csv_table(values: Values, run: str, stem: str, columns: Mapping[str, str]) -> str:
    """Some columns of a kept CSV file.

    Args:
        values: of the kept runs.
        run: its name.
        stem: of the file.
        columns: name -> heading.
    """
    lines = [f"| {' | '.join(columns.values())} |", "|---" * len(columns) + "|"]
    for row in values.rows(run, stem):
        cells = ("" if pd.isna(row[name]) else _short(row[name]) for name in columns)
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def printed_table(values: Values, run: str, file: str, number: int) -> str:
    """One of the tables that a command printed, the first is 0."""
    return values.text(run, file).strip().split("\n\n")[number]


def tables_of(values: Values, figures: Figures) -> dict[str, Table]:
    """Name in a page -> table of figures."""

    def of_one(run: str, against: str) -> Table:
        return Table((run,), partial(accuracy_table, values, figures, run, against))

    def of_csv(run: str, stem: str, columns: Mapping[str, str]) -> Table:
        return Table((run,), partial(csv_table, values, run, stem, columns))

    def printed(run: str, file: str, number: int) -> Table:
        return Table((run,), partial(printed_table, values, run, file, number))

    def of_files(run: str, first: str, against: str) -> Table:
        return Table((run,), partial(towers_table, values, run, first, against))

    both = {"synthetic": TRUTH, "ts40k": ""}
    return {
        "figures of both": Table(tuple(both), partial(short_table, values, figures, both)),
        "figures of synthetic crops against the truth": of_one("synthetic", TRUTH),
        "figures of synthetic crops against the labels": of_one("synthetic", ""),
        "figures of the six crops": of_one("ts40k", ""),
        "figures of the dataset": of_csv("dataset", "dataset", DATASET),
        "figures of its labelled towers": of_csv("dataset", "towers", LABELLED),
        "figures of its classes": of_csv("dataset", "classes", CLASSES),
        "figures of models at the scale of the thesis": of_csv("full", "models", MODELS),
        "figures of claims at the scale of the thesis": of_csv("full", "claims", VERDICTS),
        "figures of parameters without training": of_csv("full", "runs", PUBLISHED_RUNS),
        "figures of synthetic and real crops": printed("domain_gap", "crops.txt", 0),
        "figures of what separates them": printed("domain_gap", "crops.txt", 1),
        "figures of synthetic lines": of_files("lines", "seed of the line", TRUTH),
        "figures of recordings": of_files("recordings", "recording", ""),
        "figures of streets": of_files("streets", "recording", ""),
        "figures of conductors of recordings": Table(
            ("wires",), partial(points_table, values, "wires", "recording")
        ),
        "figures of conductors of recordings with the line": Table(
            ("wires_and_line",), partial(points_table, values, "wires_and_line", "recording")
        ),
        "figures of observers of conductors": printed("observers", "observers.txt", 0),
        "figures of wires in surveys": printed("wires_in_surveys", "surveys.txt", 0),
        "figures of wires without other lines": printed("wires_in_surveys", "alone.txt", 0),
        "figures of wires at towers": printed("wires_at_towers", "wires_at_towers.txt", 0),
        "figures of wires at towers with the line": printed("wires_at_towers", "with_line.txt", 0),
        "figures of conductors of known lines": printed("line_truth", "line.txt", 0),
        "figures of clearances of known lines": printed("line_truth", "line.txt", 1),
        "figures of conductors in cuts": printed("line_truth", "cuts.txt", 0),
        "figures of observers of vegetation": printed("vegetation", "vegetation.txt", 0),
        "figures of training on synthetic crops": printed("transfer", "transfer.txt", 0),
    }


def _order(figures: Figures, row: Row) -> tuple[int, bool]:
    """Place of a row in a table: as in ``sources``, without rules first."""
    sources = list(figures.sources)
    if row["model"] not in sources:
        raise InputError(f"{row['model']!r} has no name", file=FIGURES, place="sources")
    return sources.index(row["model"]), row["rules"] == WITH


def _case(figures: Figures, row: Row) -> list[str]:
    """The first cells of a row of a table."""
    return [figures.sources[row["model"]], {WITH: "yes", WITHOUT: "no"}.get(row["rules"], "")]


def _of_run(values: Values, figures: Figures, run: str) -> str:
    """When a run was made, with how many seeds, and which sources it lacks."""
    rows = values.rows(run, "components")
    seeds = {
        row["model"]: row["n_seeds"]
        for row in rows
        if row["parameters"] > 0 and row["model"] != PUBLISHED
    }
    title, most = figures.runs[run].title, max(seeds.values(), default=1)
    fewer = [f"{figures.sources[model]}: {n}" for model, n in seeds.items() if n < most]
    measured = {row["model"] for row in rows}
    missing = [name for model, name in figures.sources.items() if model not in measured]
    text = f"{title[0].upper()}{title[1:]}: measured {made_on(values.root, run)} with {most} seeds"
    text += f" ({'; '.join(fewer)})" if fewer else ""
    return text + (f"; without {'; '.join(missing)}." if missing else ".")


def _p_r(row: Row, column: str) -> str:
    return f"{row[f'{column}precision']:.2f}, {row[f'{column}recall']:.2f}"


def _f05(row: Row, column: str) -> str:
    mean, worst = row[f"{column}f05"], row[f"{column}f05_worst"]
    return f"{mean:.2f}" + (f", {worst:.2f}" if row["n_seeds"] > 1 else "")


def _towers(row: Row, against: str) -> str:
    if pd.isna(row[f"{against}towers_found"]):
        return ""
    mean, worst = (
        " / ".join(tidy(row[f"{against}towers_{what}{end}"]) for what in ("found", "false"))
        for end in ("", "_worst")
    )
    return f"{mean} ({worst})" if row["n_seeds"] > 1 else mean


def _short(cell: Any) -> str:
    """Four digits of a number and more before the point; anything else as it is."""
    if not isinstance(cell, float):
        return str(cell)
    return f"{cell:.0f}" if abs(cell) >= 1e4 else f"{cell:.4g}"


def tidy(number: float) -> str:
    """A number with a decimal where it is not zero."""
    return f"{number:.1f}".removesuffix(".0")
