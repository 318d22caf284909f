"""The tables of the claims, and of the published numbers that carry no verdict."""

from __future__ import annotations

import math
from pathlib import Path

import pandas as pd

from scenenet.core.files import atomic
from scenenet.experiments.published import Thesis
from scenenet.results.claims import of_models, of_studies
from scenenet.results.claims.claim import Judged, judge
from scenenet.results.claims.evidence import Evidence
from scenenet.results.folder import Results

CLAIMS = (*of_models.CLAIMS, *of_studies.CLAIMS)
"""Every claim, in the order of the table."""

COLUMNS = ("name", "place", "claim", "statistic", "asserted_low", "asserted_high", "value", "low",
           "high", "replicates", "verdict", "remark")  # fmt: skip


def claims(results: Results, thesis: Thesis) -> pd.DataFrame:
    """A row per claim of chapter 5 with its statistic, interval of 95 % and verdict.

    ``asserted_low`` and ``asserted_high`` are where the statistic lies if the claim is true, empty
    without a bound. ``remark`` says why a claim cannot be told, or what was found where it does not
    hold.
    """
    evidence = Evidence(results, thesis)
    rows = [_row(judge(claim, evidence)) for claim in CLAIMS]
    return pd.DataFrame(rows, columns=list(COLUMNS)).astype({"replicates": "Int64"})


def write_claims(results: Results, thesis: Thesis, out: str | Path, out_times: str | Path) -> None:
    """Write ``claims`` as two CSV files: those about times apart, because they differ between equal
    runs."""
    every = claims(results, thesis)
    timed = every["name"].isin([claim.name for claim in CLAIMS if claim.timed])
    for part, path in ((every[~timed], out), (every[timed], out_times)):
        with atomic(path) as partial:
            part.to_csv(partial, index=False, float_format="%.6g")


def _row(judged: Judged) -> tuple[object, ...]:
    claim, found = judged.claim, judged.found
    # The bound of "above 0" is the least number above it, which reads as 0.
    bounds = [None if math.isinf(b) else round(b, 12) + 0.0 for b in claim.asserted]
    measured = (None, None, None, None) if found is None else found
    return (claim.name, claim.place, claim.says, claim.statistic, *bounds, *measured,
            judged.verdict, judged.remark)  # fmt: skip
