"""The table of the observers: models of other targets than towers."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd

from scenenet.evaluation.result import PointScores, Scores
from scenenet.experiments.published import Thesis
from scenenet.metrics.score_columns import POINT_SCORES, TOWER_ONLY_SCORES, TRUTH
from scenenet.results.folder import Results
from scenenet.results.score_tables import n_parameters
from scenenet.results.seed_result import SeedResult

EVERY_POINT = "every point"
"""Name of the trivial answer."""


def observers(results: Results, thesis: Thesis | None = None) -> pd.DataFrame:
    """Scores of points and voxels on the test squares of each observer: a row for the observer, one
    for the boosted trees of the same squares, and one for the trivial answer that every point is
    the target, of which points alone are scored."""
    scored = [f"point_{name}" for name in POINT_SCORES]
    scored += [f"voxel_{name}" for name in TOWER_ONLY_SCORES]
    columns = ["observer", "model", "target", "seed", "tau", "parameters", "squares"]
    columns += [f"{TRUTH}{name}" for name in scored] + scored
    rows: list[dict[str, object]] = []
    for name in results.observers:
        found = results.observer(name)
        if found is None:
            continue
        trees = results.trees_of_observer(name)
        rows.append(_row(name, found, n_parameters(found)))
        if trees is not None:
            rows.append(_row(name, trees, trees.evaluation.parameters))
        rows.append(_trivial(name, found))
    return pd.DataFrame(rows, columns=columns).astype({"seed": "Int64", "parameters": "Int64"})


def _row(observer: str, found: SeedResult, parameters: int | None) -> dict[str, object]:
    scores = found.evaluation
    row: dict[str, object] = {
        "observer": observer,
        "model": found.kind,
        "target": scores.target,
        "seed": found.seed,
        "tau": scores.voxel.tau,
        "parameters": parameters,
        "squares": scores.voxel.n_samples,
    }
    return row | dict(_scores(scores.truth, TRUTH)) | dict(_scores(scores, ""))


def _trivial(observer: str, found: SeedResult) -> dict[str, object]:
    scores = found.evaluation
    row: dict[str, object] = {
        "observer": observer,
        "model": EVERY_POINT,
        "target": scores.target,
        "parameters": 0,
        "squares": scores.voxel.n_samples,
    }
    for start, known in ((TRUTH, scores.truth), ("", scores)):
        if known is not None and known.points is not None:
            row |= dict(_points(known.points.of_every_point, start))
    return row


def _scores(scores: Scores | None, start: str) -> Mapping[str, float | None]:
    """The scores against something; empty where it is not known."""
    if scores is None:
        return {}
    found = {f"{start}voxel_{n}": getattr(scores.voxel, n) for n in TOWER_ONLY_SCORES}
    return found if scores.points is None else found | dict(_points(scores.points, start))


def _points(points: PointScores, start: str) -> Mapping[str, float | None]:
    return {f"{start}point_{name}": getattr(points, name) for name in POINT_SCORES}
