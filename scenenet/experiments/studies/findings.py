"""The findings of a study, in sentences that follow from its numbers by rule."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from scenenet.experiments.studies.settings import StudySettings

ERRORS = 2.0
"""Two means over seeds within so many standard errors of their difference are called equal."""
NAMED = 3
"""Up to so many variants are listed by name; for more there is only their number."""


def findings(study: StudySettings, summary: pd.DataFrame) -> str:
    """Best and lowest variant; variants equal to the best; dead models; negative parameters.

    Args:
        summary: of ``scenenet.experiments.studies.summary``, or as it was written.
    """
    if summary["f05"].max() <= 0:
        return "No variant detects a tower voxel."
    best = summary.loc[summary["f05"].idxmax()]
    lowest = summary.loc[summary["f05"].idxmin()]
    sentences = [f"Best: {_scored(best)}. Lowest: {_scored(lowest)}."]
    if len(study.seeds) == 1:
        sentences.append("There is one seed, so the spread over seeds is unknown.")
    else:
        near = summary.loc[as_good_as_best(summary), "variant"].drop(index=best.name)
        others = len(summary) - 1
        sentences.append(
            f"Equal to the best within {ERRORS:g} standard errors: {_named(list(near), others)}."
        )
    dead = summary[summary["alive"] < summary["n_seeds"]]
    if len(dead):
        each = [f"{r.variant} ({r.n_seeds - r.alive} of {r.n_seeds})" for r in dead.itertuples()]
        sentences.append(f"Dead models: {_named(each, len(summary))}.")
    return " ".join([*sentences, *_negative(summary)])


def as_good_as_best(summary: pd.DataFrame) -> pd.Series:
    """Whether F0.5 of each variant is within ``ERRORS`` standard errors of the best one's.

    The error is that of the difference of two means over seeds; (V,) bool, the best one included.
    """
    squared = summary["f05_std"].fillna(0) ** 2 / summary["n_seeds"]
    best = summary["f05"].idxmax()
    error = (squared + squared[best]) ** 0.5
    return summary["f05"] >= summary["f05"][best] - ERRORS * error


def _negative(summary: pd.DataFrame) -> list[str]:
    """A sentence if the variants differ in how often training ends with a negative parameter."""
    known = summary.dropna(subset="negative_share")
    shares = known["negative_share"]
    if not len(shares) or shares.min() == shares.max() or len(known) > NAMED + 1:
        return []
    each = [
        f"{r.variant} ({round(r.negative_share * r.n_seeds)} of {r.n_seeds} seeds)"
        for r in known.itertuples()
    ]
    return [f"Ends with a negative parameter: {', '.join(each)}."]


def _scored(row: pd.Series) -> str:
    spread = "" if row["f05_std"] != row["f05_std"] else f" ± {row['f05_std']:.2f}"
    return f"{row['variant']} with F0.5 {row['f05']:.2f}{spread}"


def _named(variants: Sequence[str], others: int) -> str:
    if not variants:
        return "none"
    return "; ".join(variants) if len(variants) <= NAMED else f"{len(variants)} of {others}"
