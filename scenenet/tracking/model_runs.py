"""What the MLflow runs of a result folder consist of."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import fmean, stdev
from typing import TYPE_CHECKING, Any

from scenenet.core.files import digest
from scenenet.results.folder import BOOSTED_TREES, Results, SeedResult
from scenenet.tracking.run_log import NOTE_TAG, RunGroup, RunRecord

if TYPE_CHECKING:
    from scenenet.figures import Picture

SCORES = ("precision", "recall", "f05", "iou_tower", "miou")
TOWER_SCORES = ("precision", "recall", "median_error_m", "n_true", "n_predicted")


def model_groups(
    results: Results,
    dataset: str,
    settings: Mapping[str, Mapping[str, Any]] | None = None,
    protocol: str = "",
    pictures: Sequence[Picture] = (),
    study: str = "reproduction",
) -> list[RunGroup]:
    """One parent per model, the boosted trees among them, with a run per seed under it.

    Args:
        results: the result folder.
        dataset: name of the data, part of every key, so that runs on other data stand beside.
        settings: settings of each model beyond those its training recorded, by model name.
        protocol: how the data were split and voxelised, in words, for a tag.
        pictures: figures to attach to the parents of the models they show.
        study: the question the runs belong to, for a tag.
    """
    base = {"study": study, "dataset": dataset, "protocol": protocol}
    groups = []
    trainings = {model: results.of_model(model) for model in results.models}
    for model, trained in (trainings | {BOOSTED_TREES: results.boosted_trees}).items():
        if not trained:
            continue
        own = (settings or {}).get(model, {})
        key = f"{study}/{dataset}/{model}"
        children = [_seed_record(result, key, base, own) for result in trained]
        shown = [picture for picture in pictures if model in picture.models]
        champion = results.champion(model) if model in trainings else None
        parent = _parent_record(trained, champion, key, base, children, shown)
        groups.append(RunGroup(parent, children))
    return groups


def flatten(settings: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested settings with dotted names; lists as JSON, because MLflow keeps plain text."""
    flat: dict[str, Any] = {}
    for name, value in settings.items():
        if isinstance(value, Mapping):
            flat |= flatten(value, f"{prefix}{name}.")
        else:
            flat[f"{prefix}{name}"] = (
                json.dumps(value) if isinstance(value, list | tuple) else value
            )
    return flat


def _seed_record(
    result: SeedResult, group: str, base: Mapping[str, str], own: Mapping[str, Any]
) -> RunRecord:
    provenance = result.provenance or {}
    history, epochs = _history(result)
    return RunRecord(
        key=f"{group}/seed-{result.seed}",
        name=f"{result.model} seed {result.seed}",
        params=flatten({**own, **provenance.get("settings", {}), "seed": result.seed}),
        metrics=_final_metrics(result),
        history=history,
        epochs=epochs,
        tags={
            **base,
            "model": result.model,
            "kind": result.kind,
            "seed": str(result.seed),
            "alive": str(result.alive).lower(),
            **origin_tags(provenance),
        },
        artifacts={f"model/{path.name}": path for path in result.model_files},
        drawings=_drawings(result),
        seconds=result.seconds or 0.0,
    )


def origin_tags(provenance: Mapping[str, Any]) -> dict[str, str]:
    """Config hash, data fingerprint and code version, from the record of a training or a study."""
    if not provenance:
        return {}
    return {
        "scenenet.config": str(provenance.get("config", "")),
        "scenenet.data": digest(provenance.get("inputs", {})),
        "scenenet.code": str(provenance.get("code", "")),
        "scenenet.version": str(provenance.get("version", "")),
    }


def _history(result: SeedResult) -> tuple[dict[str, list[float]], list[int]]:
    if result.history is None:
        return {}, []
    columns = [name for name in result.history.columns if name != "epoch"]
    measures = {name: result.history[name].astype(float).tolist() for name in columns}
    return measures, result.history["epoch"].astype(int).tolist()


def _final_metrics(result: SeedResult) -> dict[str, float | None]:
    test, towers = result.evaluation["voxel"], result.evaluation["towers"]
    # MLflow's plots begin with the first: it is the one that the thesis chooses by.
    scores = sorted(SCORES, key=lambda name: name != "f05")
    metrics: dict[str, float | None] = {f"test_{name}": test[name] for name in scores}
    metrics["test_average_precision"] = result.evaluation.get("average_precision")
    metrics |= {f"validation_{n}": result.validation[n] for n in scores if n in result.validation}
    metrics |= {f"towers_{name}": towers[name] for name in TOWER_SCORES}
    metrics |= {"tau": test.get("tau"), "alive": float(result.alive)}
    return metrics


def _drawings(result: SeedResult) -> dict[str, Any]:
    drawings: dict[str, Any] = {}
    if result.history is not None:
        history = result.history

        def draw_training(path: Path) -> None:
            from scenenet.figures.plots.curves import training

            training({f"seed {result.seed}": history}, path)

        drawings["figures/training.png"] = draw_training
    if result.evaluation.get("pr_curve"):

        def draw_curve(path: Path) -> None:
            from scenenet.figures.plots.curves import precision_recall

            precision_recall({result.model: [result.evaluation["pr_curve"]]}, path)

        drawings["figures/precision_recall.png"] = draw_curve
    return drawings


def _parent_record(
    trained: Sequence[SeedResult],
    champion: SeedResult | None,
    key: str,
    base: Mapping[str, str],
    children: Sequence[RunRecord],
    pictures: Sequence[Picture],
) -> RunRecord:
    """Mean, spread and share of live seeds on the group, with the trivial baseline beside.

    Charts show a group as one line, so the parent carries numbers of its own. Dead seeds count in
    the means; ``test_f05_live_mean`` and the like leave them out.
    """
    live = [child for child, result in zip(children, trained, strict=True) if result.alive]
    metrics: dict[str, float | None] = {}
    for name in children[0].metrics:
        if name == "alive":
            continue
        metrics |= _summary(name, children)
        if name.startswith("test_"):
            metrics |= _summary(f"{name}_live", live, of=name)
    metrics |= {"seeds": len(trained), "alive_share": len(live) / len(trained)}
    for name in SCORES:
        metrics[f"trivial_{name}"] = fmean(r.evaluation["voxel_trivial"][name] for r in trained)
    if champion is not None:
        metrics["champion_seed"] = champion.seed
        metrics |= {f"champion_test_{n}": champion.evaluation["voxel"][n] for n in SCORES}
    common = {
        name: value
        for name, value in children[0].params.items()
        if all(child.params.get(name) == value for child in children) and name != "seed"
    }
    model = trained[0].model
    return RunRecord(
        key=key,
        name=f"{model} ({base['dataset']})",
        params=common,
        metrics=metrics,
        tags={
            **base,
            "model": model,
            "kind": trained[0].kind,
            NOTE_TAG: _note(trained, len(live)),
        },
        artifacts={f"figures/{picture.file.name}": picture.file for picture in pictures},
        seconds=sum(result.seconds or 0.0 for result in trained),
    )


def _summary(
    name: str, children: Sequence[RunRecord], of: str | None = None
) -> dict[str, float | None]:
    values = [child.metrics.get(of or name) for child in children]
    known = [value for value in values if value is not None and not math.isnan(value)]
    if not known:
        return {}
    summary: dict[str, float | None] = {f"{name}_mean": fmean(known)}
    if len(known) > 1:
        summary[f"{name}_std"] = stdev(known)
    return summary


def _note(trained: Sequence[SeedResult], n_live: int) -> str:
    seeds = "seed" if len(trained) == 1 else "seeds"
    return (
        f"Summary over {len(trained)} {seeds}, {n_live} of which detect anything. `_mean` and "
        "`_std` are over all of them, `_live_mean` over those that do; `trivial_` is a model that "
        "never says tower; `champion_` is the one with the highest F0.5 on validation."
    )
