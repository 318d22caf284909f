"""What the thesis claims, what of it holds on the data of this run, and the published numbers."""

from __future__ import annotations

import pandas as pd

from scenenet.report.blocks import Block, Column, Facts, Section, Text, table
from scenenet.report.context import ReportContext
from scenenet.results.claims.claim import HOLDS, NOT, OPEN, VERDICTS

CLAIMS = (
    Column("place", "thesis"),
    Column("claim", "claim"),
    Column("verdict", "verdict"),
    Column("statistic", "statistic"),
    Column("value", "value", "number"),
    Column("low", "95 % from", "number"),
    Column("high", "to", "number"),
    Column("replicates", "replicates", "count"),
    Column("remark", "remark"),
)
CAPTION = (
    "Each claim of chapter 5 with a statistic that would show it, and its confidence interval over "
    f"seeds. {HOLDS}: the whole interval lies where the claim says; {NOT}: no part of it; {OPEN}: "
    "otherwise, or if a model that the claim is about is no better than marking nothing or "
    "everything. Where a claim does not hold, the value says what was found, and the remark what "
    "the study of it shows."
)
NUMBERS = (
    Column("place", "thesis"),
    Column("what", "number"),
    Column("thesis", "published", "number", "spread", published=True),
    Column("low", "from", "number", published=True),
    Column("high", "to", "number", published=True),
    Column("ours", "this run", "number"),
    Column("unit", "unit"),
)


def claims(context: ReportContext) -> Section | None:
    """Every claim with its verdict, and on what data, where the run decides at least one."""
    frame = _both(context, "claims")
    if frame is None or _all_open(frame):
        return None
    counts = frame["verdict"].value_counts()
    facts = [("claims", str(len(frame)))]
    facts += [(verdict, str(counts.get(verdict, 0))) for verdict in VERDICTS]
    blocks: list[Block] = [Facts(facts)]
    if data := _data(context):
        blocks.append(Text(data))
    blocks.append(_table(frame))
    return Section("claims", "What the thesis claims and what holds", blocks)


def open_claims(context: ReportContext) -> Section | None:
    """Every claim, where the run decides none. Its reader looks for other things first."""
    frame = _both(context, "claims")
    if frame is None or not _all_open(frame):
        return None
    text = f"This run decides none of the {len(frame)} claims of chapter 5. {_data(context)}"
    return Section("claims", "What the thesis claims", [Text(text.strip()), _table(frame)])


def _all_open(frame: pd.DataFrame) -> bool:
    return bool((frame["verdict"] == OPEN).all())


def _table(frame: pd.DataFrame) -> Block:
    source = "tables/claims.csv, tables/claims_times.csv"
    shown = frame.astype({"remark": object}).fillna({"remark": ""})
    return table(shown, CLAIMS, CAPTION, source, folded=True)


def published_numbers(context: ReportContext) -> Section | None:
    """Every number of ``config/thesis.yaml`` with the number of this run."""
    frame = _both(context, "published_numbers")
    if frame is None:
        return None
    caption = (
        "Every published number. Most are settings, counts and scores of one run; they carry no "
        "verdict. Each architecture is represented by its first model, with the mean over all "
        "seeds."
    )
    source = "tables/published_numbers.csv, tables/published_numbers_times.csv"
    shown = table(frame.fillna({"unit": ""}), NUMBERS, caption, source, folded=True)
    return Section("thesis", "Published numbers", [shown])


def _both(context: ReportContext, name: str) -> pd.DataFrame | None:
    """A table and its part about times."""
    parts = [context.table(stem) for stem in (name, f"{name}_times")]
    found = [part for part in parts if part is not None]
    return pd.concat(found, ignore_index=True) if found else None


def _data(context: ReportContext) -> str:
    """On what data the claims were judged, in a sentence; empty without a split."""
    split = context.results.split()
    if split is None:
        return ""
    parts = split["part"].value_counts()
    counts = ", ".join(f"{parts[part]} for {part}" for part in parts.index if part != "guard")
    return (
        f"Data: {len(split)} crops of {', '.join(context.results.surveys)} ({counts}), "
        f"{len(context.results.seeds)} seeds. The thesis has 2823 crops, 565 of them for training."
    )
