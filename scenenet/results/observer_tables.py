"""The table of the observers: models of other targets than towers."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd

from scenenet.evaluation.result import Scores
from scenenet.experiments.published import Thesis
from scenenet.metrics.score_columns import POINT_SCORES, TOWER_ONLY_SCORES, TRUTH
from scenenet.results.folder import Results
from scenenet.results.score_tables import n_parameters


def observers(results: Results, thesis: Thesis | None = None) -> pd.DataFrame:
    """One row per observer: its target, and scores of points and voxels on its test squares."""
    scored = [f"point_{name}" for name in POINT_SCORES]
    scored += [f"voxel_{name}" for name in TOWER_ONLY_SCORES]
    columns = ["observer", "target", "seed", "tau", "parameters", "squares"]
    columns += [f"{TRUTH}{name}" for name in scored] + scored
    rows = []
    for name in results.observers:
        found = results.observer(name)
        if found is None:
            continue
        scores = found.evaluation
        row: dict[str, object] = {
            "observer": name,
            "target": scores.target,
            "seed": found.seed,
            "tau": scores.voxel.tau,
            "parameters": n_parameters(found),
            "squares": scores.voxel.n_samples,
        }
        rows.append(row | dict(_scores(scores.truth, TRUTH)) | dict(_scores(scores, "")))
    return pd.DataFrame(rows, columns=columns)


def _scores(scores: Scores | None, start: str) -> Mapping[str, float | None]:
    """The scores against something; empty where it is not known."""
    if scores is None:
        return {}
    found = {f"{start}voxel_{n}": getattr(scores.voxel, n) for n in TOWER_ONLY_SCORES}
    points = scores.points
    if points is not None:
        found |= {f"{start}point_{name}": getattr(points, name) for name in POINT_SCORES}
    return found
