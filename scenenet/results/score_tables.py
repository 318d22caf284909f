"""Tables of the scores of models (thesis 5.2)."""

from __future__ import annotations

from collections.abc import Iterable

import pandas as pd

from scenenet.experiments.published import Published, Thesis
from scenenet.metrics.score_columns import (
    AT_TAU,
    MATCH_SCORES,
    PUBLISHED_SCORES,
    SCORES,
    TOWER_ONLY_SCORES,
    WHOLE_TOWERS,
)
from scenenet.results.folder import BOOSTED_TREES, Results, SeedResult

TRIVIAL = "nothing detected"
"""Name of the trivial baseline, a model that never predicts tower."""


def seeds(results: Results, thesis: Thesis | None = None) -> pd.DataFrame:
    """One row per model and seed: test scores, tower scores, tau and epochs."""
    columns = ["model", "seed", "alive", "tau", "validation_f05", *SCORES, "average_precision",
               *(f"tower_{name}" for name in MATCH_SCORES), "epochs"]  # fmt: skip
    rows = []
    for result in results.trained:
        voxel, tower = result.evaluation.voxel, result.evaluation.towers
        rows.append(
            (
                result.model,
                result.seed,
                result.alive,
                voxel.tau,
                result.validation.get("f05"),
                *(getattr(voxel, name) for name in SCORES),
                result.evaluation.average_precision,
                *(getattr(tower, name) for name in MATCH_SCORES),
                result.epochs,
            )
        )
    return pd.DataFrame(rows, columns=columns)


def models(results: Results, thesis: Thesis) -> pd.DataFrame:
    """Table 5.3: voxel scores on the test crops, with those of the thesis and a trivial baseline.

    Column ``counted`` names the trainings of a row: ``all seeds``, ``live seeds`` (only if some
    models are dead), or the seed that is best on validation, which classifies surveys. The thesis
    reports live models only (5.2.6). The boosted trees (``scenenet.baselines.boosted_trees``) are
    trained, tuned and scored on the same crops. Column ``voxels`` says which voxels count as
    detected: ``AT_TAU`` or ``WHOLE_TOWERS`` (docs/method/detection.md).
    """
    columns = ["model", "counted", "voxels", "n_seeds", "live_share", "parameters"]
    columns += [f"{name}{part}" for name in SCORES for part in ("", "_std")]
    for name in PUBLISHED_SCORES:
        columns += [f"thesis_{name}", f"thesis_{name}_std"]
    rows = []
    for model, kind in results.models.items():
        trained = results.of_model(model)
        for counted, group in _counted(trained, results.champion(model)):
            row = {
                "model": model,
                "counted": counted,
                "voxels": WHOLE_TOWERS if _counts_whole_towers(group) else AT_TAU,
                "n_seeds": len(group),
                "live_share": sum(r.alive for r in trained) / len(trained),
                "parameters": n_parameters(group[0]),
            }
            row |= _mean_and_std(group, "voxel", SCORES)
            row |= _published_scores(thesis, kind)
            rows.append(row)
    if results.boosted_trees:
        group = results.boosted_trees
        row = {
            "model": BOOSTED_TREES,
            "counted": "all seeds",
            "voxels": AT_TAU,
            "n_seeds": len(group),
            "live_share": sum(r.alive for r in group) / len(group),
            "parameters": round(sum(r.evaluation.parameters or 0 for r in group) / len(group)),
        }
        rows.append(row | _mean_and_std(group, "voxel", SCORES))
    if results.trained:
        baseline = _mean_and_std(results.trained, "voxel_trivial", SCORES)
        scores = {name: baseline[name] for name in SCORES}
        rows.append({"model": TRIVIAL, "counted": "-", "voxels": "-", "parameters": 0, **scores})
    return pd.DataFrame(rows, columns=columns).astype({"n_seeds": "Int64", "parameters": "Int64"})


def whole_towers(results: Results, thesis: Thesis | None = None) -> pd.DataFrame:
    """Scores of the voxels at or above tau, and of the voxels of whole towers.

    One row per model, the boosted trees included: mean and spread over all seeds
    (docs/method/detection.md).
    """
    parts = {"tau": "voxel_observer", "towers": "voxel_towers"}
    columns = ["model", "n_seeds"]
    columns += [
        f"{part}_{n}{end}" for part in parts for n in TOWER_ONLY_SCORES for end in ("", "_std")
    ]
    groups = {model: results.of_model(model) for model in results.models}
    rows = []
    for model, group in (groups | {BOOSTED_TREES: results.boosted_trees}).items():
        if not group:
            continue
        row: dict[str, object] = {"model": model, "n_seeds": len(group)}
        for part, of in parts.items():
            found = _mean_and_std(group, of, TOWER_ONLY_SCORES)
            row |= {f"{part}_{name}": value for name, value in found.items()}
        rows.append(row)
    return pd.DataFrame(rows, columns=columns)


def _counts_whole_towers(group: list[SeedResult]) -> bool:
    return group[0].evaluation.whole_towers


def tower_scores(results: Results, thesis: Thesis | None = None) -> pd.DataFrame:
    """Predicted towers matched with labelled ones on the test crops: mean and spread over seeds."""
    columns = ["model", "counted", "n_seeds"]
    columns += [f"{name}{part}" for name in MATCH_SCORES for part in ("", "_std")]
    rows = []
    for model in results.models:
        for counted, group in _counted(results.of_model(model), results.champion(model)):
            row = {"model": model, "counted": counted, "n_seeds": len(group)}
            rows.append(row | _mean_and_std(group, "towers", MATCH_SCORES))
    return pd.DataFrame(rows, columns=columns)


def n_parameters(result: SeedResult) -> int | None:
    """Number of trained parameters of a model, counted in its file; None without a file."""
    if not result.model_files:
        return None
    from scenenet.models.model_file import read_model

    model, _ = read_model(result.model_files[0])
    return model.n_parameters()


def _counted(
    trained: list[SeedResult], champion: SeedResult | None
) -> Iterable[tuple[str, list[SeedResult]]]:
    if not trained:
        return
    yield "all seeds", trained
    live = [result for result in trained if result.alive]
    if 0 < len(live) < len(trained):
        yield "live seeds", live
    if champion is not None:
        yield f"seed {champion.seed}, best on validation", [champion]


def _mean_and_std(
    group: list[SeedResult], part: str, names: Iterable[str]
) -> dict[str, float | None]:
    summary: dict[str, float | None] = {}
    for name in names:
        values = pd.Series([getattr(getattr(r.evaluation, part), name) for r in group], dtype=float)
        summary |= {name: values.mean(), f"{name}_std": values.std()}
    return summary


def _published_scores(thesis: Thesis, kind: str) -> dict[str, float | None]:
    scores: dict[str, float | None] = {}
    for name in PUBLISHED_SCORES:
        number = thesis.number(f"models.{kind}.{name}") or Published(place="")
        scores |= {f"thesis_{name}": number.value, f"thesis_{name}_std": number.spread}
    return scores
