"""Tables of the scores of models (thesis 5.2)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from scenenet.experiments.published import Published, Thesis
from scenenet.results.folder import BOOSTED_TREES, Results, SeedResult

if TYPE_CHECKING:
    import pandas as pd


SCORES = ("precision", "recall", "f05", "iou_tower", "miou")


TRIVIAL = "nothing detected"
"""Name of the trivial baseline, a model that never says tower, where others have theirs."""


REACH_TAU, WHOLE_TOWERS = "reach tau", "of whole towers"
"""Which voxels a model calls a tower's."""


def seeds(results: Results, thesis: Thesis | None = None) -> pd.DataFrame:
    """One row per model and seed: test scores, tower scores, tau and training time."""
    import pandas as pd

    columns = ["model", "seed", "alive", "tau", "validation_f05", *SCORES, "average_precision",
               *(f"tower_{name}" for name in TOWER_SCORES), "epochs",
               "training_seconds"]  # fmt: skip
    rows = []
    for result in results.trained:
        voxel, tower = result.evaluation["voxel"], result.evaluation["towers"]
        rows.append(
            (
                result.model,
                result.seed,
                result.alive,
                voxel["tau"],
                result.validation.get("f05"),
                *(voxel[name] for name in SCORES),
                result.evaluation.get("average_precision"),
                *(tower[name] for name in TOWER_SCORES),
                result.epochs,
                result.seconds,
            )
        )
    return pd.DataFrame(rows, columns=columns)


def models(results: Results, thesis: Thesis) -> pd.DataFrame:
    """Table 5.3: voxel scores on the test crops, the thesis' beside, and the trivial baseline.

    Up to three rows per model tell which trainings were counted: ``all seeds``, ``live seeds``
    (those that detect anything; only where some do not) and the one that is best on validation,
    which is the one that predicts. The thesis counts useful trainings only (5.2.6). The boosted
    trees (``scenenet.baselines.boosted_trees``) were trained, tuned and scored on the same crops.
    ``voxels`` says which the model calls a tower's: those that reach tau, or those of whole towers
    (docs/method/detection.md).
    """
    import pandas as pd

    columns = ["model", "counted", "voxels", "n_seeds", "live_share", "parameters"]
    columns += [f"{name}{part}" for name in SCORES for part in ("", "_std")]
    for name in ("precision", "recall", "miou"):
        columns += [f"thesis_{name}", f"thesis_{name}_std"]
    rows = []
    for model, kind in results.models.items():
        trained = results.of_model(model)
        for counted, group in _counted(trained, results.champion(model)):
            row = {
                "model": model,
                "counted": counted,
                "voxels": WHOLE_TOWERS if _says_towers(group) else REACH_TAU,
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
            "voxels": REACH_TAU,
            "n_seeds": len(group),
            "live_share": sum(r.alive for r in group) / len(group),
            "parameters": round(sum(r.evaluation["parameters"] for r in group) / len(group)),
        }
        rows.append(row | _mean_and_std(group, "voxel", SCORES))
    if results.trained:
        baseline = _mean_and_std(results.trained, "voxel_trivial", SCORES)
        scores = {name: baseline[name] for name in SCORES}
        rows.append({"model": TRIVIAL, "counted": "-", "voxels": "-", "parameters": 0, **scores})
    return pd.DataFrame(rows, columns=columns).astype({"n_seeds": "Int64", "parameters": "Int64"})


def whole_towers(results: Results, thesis: Thesis | None = None) -> pd.DataFrame:
    """Scores of the voxels that reach tau beside those of whole towers that are found with them
    (docs/method/detection.md): a row per model, mean and spread over all seeds, boosted trees
    included."""
    import pandas as pd

    parts = {"tau": "voxel_observer", "towers": "voxel_towers"}
    names = ("precision", "recall", "f05", "iou_tower")
    columns = ["model", "n_seeds"]
    columns += [f"{part}_{n}{end}" for part in parts for n in names for end in ("", "_std")]
    groups = {model: results.of_model(model) for model in results.models}
    rows = []
    for model, group in (groups | {BOOSTED_TREES: results.boosted_trees}).items():
        if not group:
            continue
        row: dict[str, object] = {"model": model, "n_seeds": len(group)}
        for part, of in parts.items():
            found = _mean_and_std(group, of, names)
            row |= {f"{part}_{name}": value for name, value in found.items()}
        rows.append(row)
    return pd.DataFrame(rows, columns=columns)


def _says_towers(group: list[SeedResult]) -> bool:
    return bool(group[0].evaluation["whole_towers"])


def tower_scores(results: Results, thesis: Thesis | None = None) -> pd.DataFrame:
    """Predicted towers against true ones on the test crops, mean and spread over seeds."""
    import pandas as pd

    columns = ["model", "counted", "n_seeds"]
    columns += [f"{name}{part}" for name in TOWER_SCORES for part in ("", "_std")]
    rows = []
    for model in results.models:
        for counted, group in _counted(results.of_model(model), results.champion(model)):
            row = {"model": model, "counted": counted, "n_seeds": len(group)}
            rows.append(row | _mean_and_std(group, "towers", TOWER_SCORES))
    return pd.DataFrame(rows, columns=columns)


TOWER_SCORES = ("precision", "recall", "median_error_m", "n_true", "n_predicted")


def n_parameters(result: SeedResult) -> int | None:
    """Trained numbers of a model, counted in its file; None where there is no file."""
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
    import pandas as pd

    summary: dict[str, float | None] = {}
    for name in names:
        values = pd.Series([r.evaluation[part][name] for r in group], dtype=float)
        summary |= {name: values.mean(), f"{name}_std": values.std()}
    return summary


def _published_scores(thesis: Thesis, kind: str) -> dict[str, float | None]:
    scores: dict[str, float | None] = {}
    for name in ("precision", "recall", "miou"):
        number = thesis.number(f"models.{kind}.{name}") or Published(place="")
        scores |= {f"thesis_{name}": number.value, f"thesis_{name}_std": number.spread}
    return scores
