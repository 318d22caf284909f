"""Tables of the scores of models (thesis 5.2).

Columns ``truth_X`` are scores against the truth, over the crops whose truth is known, and empty
without any; the others are against the labels.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import pandas as pd

from scenenet.evaluation.result import Scores
from scenenet.experiments.label_noise.settings import LABELS
from scenenet.experiments.published import Published, Thesis
from scenenet.metrics.score_columns import (
    AT_TAU,
    MATCH_SCORES,
    POINT_SCORES,
    PUBLISHED_SCORES,
    SCORES,
    TOWER_ONLY_SCORES,
    TRUTH,
    WHOLE_TOWERS,
)
from scenenet.models.settings import BOOSTED_TREES
from scenenet.results.folder import Results
from scenenet.results.seed_result import SeedResult

TRIVIAL = "nothing detected"
"""Name of the trivial baseline, a model that never predicts tower."""


def seeds(results: Results, thesis: Thesis | None = None) -> pd.DataFrame:
    """One row per model and seed: test scores, tower scores, tau and epochs."""
    scored = [*SCORES, "average_precision", *(f"tower_{name}" for name in MATCH_SCORES),
              *(f"point_{name}" for name in POINT_SCORES)]  # fmt: skip
    columns = ["model", "seed", "alive", "tau", "validation_f05", "validation_towers_f05",
               *_against_both(scored), "epochs"]  # fmt: skip
    rows = []
    for result in results.trained:
        both = [(TRUTH, result.evaluation.truth), ("", result.evaluation)]
        row = {
            "model": result.model,
            "seed": result.seed,
            "alive": result.alive,
            "tau": result.evaluation.voxel.tau,
            "validation_f05": None if result.validation is None else result.validation.f05,
            "validation_towers_f05": _of_towers(result),
            "epochs": result.epochs,
        }
        for against, scores in both:
            row |= {f"{against}{name}": value for name, value in _of_seed(scores).items()}
        rows.append(row)
    return pd.DataFrame(rows, columns=columns)


def _of_towers(result: SeedResult) -> float | None:
    """F0.5 of whole towers on the validation crops; None for a model that gives voxels."""
    tuning = result.tuning
    return None if tuning is None or tuning.whole_towers is None else tuning.whole_towers.f05


def _of_seed(scores: Scores | None) -> dict[str, float | None]:
    """The scores of one training; empty if there are none."""
    if scores is None:
        return {}
    parts = (("", "voxel", SCORES), ("tower_", "towers", MATCH_SCORES),
             ("point_", "points", POINT_SCORES))  # fmt: skip
    found = {
        f"{start}{name}": _score(scores, part, name) for start, part, names in parts
        for name in names
    }  # fmt: skip
    return found | {"average_precision": scores.average_precision}


def models(results: Results, thesis: Thesis) -> pd.DataFrame:
    """Table 5.3: voxel scores on the test crops, with those of the thesis and a trivial baseline.

    Column ``counted`` names the trainings of a row: ``all seeds``, ``live seeds`` (only if some
    models are dead), the seed that is best on validation, which classifies surveys, or the one that
    is worst on the test crops. The thesis reports live models only (5.2.6). The boosted trees
    (``scenenet.baselines.boosted_trees``) are trained, tuned and scored on the same crops. Column
    ``voxels`` says which voxels count as detected: ``AT_TAU`` or ``WHOLE_TOWERS``
    (docs/method/detection.md).
    """
    columns = ["model", "counted", "voxels", "n_seeds", "live_share", "parameters"]
    columns += _against_both(f"{name}{part}" for name in SCORES for part in ("", "_std"))
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
        scores = {name: baseline[name] for name in _against_both(SCORES)}
        rows.append({"model": TRIVIAL, "counted": "-", "voxels": "-", "parameters": 0, **scores})
    return pd.DataFrame(rows, columns=columns).astype({"n_seeds": "Int64", "parameters": "Int64"})


def whole_towers(results: Results, thesis: Thesis | None = None) -> pd.DataFrame:
    """Scores of the voxels at or above tau, and of the voxels of whole towers.

    One row per model, the boosted trees included: mean and spread over all seeds
    (docs/method/detection.md).
    """
    parts = {"tau": "voxel_observer", "towers": "voxel_towers"}
    columns = ["model", "n_seeds"]
    columns += _against_both(
        f"{part}_{n}{end}" for part in parts for n in TOWER_ONLY_SCORES for end in ("", "_std")
    )
    groups = {model: results.of_model(model) for model in results.models}
    rows = []
    for model, group in (groups | {BOOSTED_TREES: results.boosted_trees}).items():
        if not group:
            continue
        row: dict[str, object] = {"model": model, "n_seeds": len(group)}
        for part, of in parts.items():
            row |= _mean_and_std(group, of, TOWER_ONLY_SCORES, f"{part}_")
        rows.append(row)
    return pd.DataFrame(rows, columns=columns)


def _counts_whole_towers(group: list[SeedResult]) -> bool:
    return group[0].evaluation.whole_towers


def tower_scores(results: Results, thesis: Thesis | None = None) -> pd.DataFrame:
    """Predicted towers matched with labelled and true ones on the test crops: mean and spread over
    seeds."""
    return _of_models(results, "towers", MATCH_SCORES)


def point_scores(results: Results, thesis: Thesis | None = None) -> pd.DataFrame:
    """Points with a tower id against the tower points of the test crops: mean and spread over
    seeds. The last row scores the labels themselves, as if a model had predicted them."""
    frame = _of_models(results, "points", POINT_SCORES)
    of_labels = [r.evaluation.labels_against_truth for r in results.trained]
    known = next((scores for scores in of_labels if scores is not None), None)
    if known is None:
        return frame
    scores = {f"{TRUTH}{name}": getattr(known, name) for name in POINT_SCORES}
    row = pd.DataFrame([{"model": LABELS, "counted": "-", **scores}], columns=frame.columns)
    return pd.concat([frame, row], ignore_index=True)


def _of_models(results: Results, part: str, names: Sequence[str]) -> pd.DataFrame:
    """One row per model and group of its trainings, with mean and spread of some scores."""
    columns = ["model", "counted", "n_seeds"]
    columns += _against_both(f"{name}{end}" for name in names for end in ("", "_std"))
    rows = []
    for model in results.models:
        for counted, group in _counted(results.of_model(model), results.champion(model)):
            row = {"model": model, "counted": counted, "n_seeds": len(group)}
            rows.append(row | _mean_and_std(group, part, names))
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
    if len(trained) > 1:
        worst = min(trained, key=lambda result: result.evaluation.leading.voxel.decisive)
        yield f"seed {worst.seed}, worst on test", [worst]


def _mean_and_std(
    group: list[SeedResult], part: str, names: Iterable[str], start: str = ""
) -> dict[str, float | None]:
    """Mean and spread over a group of some scores, against the truth and against the labels.

    Args:
        part: attribute of ``Scores``.
        names: scores in it.
        start: beginning of the names of the columns, after that of ``TRUTH``.
    """
    summary: dict[str, float | None] = {}
    of_seeds: dict[str, list[Scores | None]] = {
        TRUTH: [r.evaluation.truth for r in group],
        "": [r.evaluation for r in group],
    }
    for name in names:
        for against, scores in of_seeds.items():
            values = pd.Series([_score(one, part, name) for one in scores], dtype=float)
            column = f"{against}{start}{name}"
            summary |= {column: values.mean(), f"{column}_std": values.std()}
    return summary


def _score(scores: Scores | None, part: str, name: str) -> float | None:
    """One score; None if it was not measured or is not defined."""
    measured = None if scores is None else getattr(scores, part)
    return None if measured is None else getattr(measured, name)


def _against_both(columns: Iterable[str]) -> list[str]:
    """Columns with scores against the truth, then those against the labels."""
    labels = list(columns)
    return [f"{TRUTH}{name}" for name in labels] + labels


def _published_scores(thesis: Thesis, kind: str) -> dict[str, float | None]:
    scores: dict[str, float | None] = {}
    for name in PUBLISHED_SCORES:
        number = thesis.number(f"models.{kind}.{name}") or Published(place="")
        scores |= {f"thesis_{name}": number.value, f"thesis_{name}_std": number.spread}
    return scores
