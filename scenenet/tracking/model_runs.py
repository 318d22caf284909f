"""The MLflow runs of the trainings in a result folder."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import fmean, stdev
from typing import TYPE_CHECKING, Any

from scenenet.core.files import digest
from scenenet.metrics.score_columns import DECISIVE_FIRST, MATCH_SCORES, POINT_SCORES, SCORES
from scenenet.models.settings import BOOSTED_TREES
from scenenet.results.folder import Results
from scenenet.results.seed_result import SeedResult
from scenenet.tracking.logged_model import ModelRecord
from scenenet.tracking.run_log import NOTE_TAG, DatasetRecord, RunGroup, RunRecord

if TYPE_CHECKING:
    from scenenet.figures import Picture


def model_groups(
    results: Results,
    dataset: str,
    settings: Mapping[str, Mapping[str, Any]] | None = None,
    protocol: str = "",
    pictures: Sequence[Picture] = (),
    study: str = "reproduction",
) -> list[RunGroup]:
    """One parent per model, the boosted trees, the observers and the trees beside these included,
    with a nested run per seed.

    Args:
        results: the result folder.
        dataset: name of the data; part of every key, so that runs on other data are kept.
        settings: settings of each model beyond those its training recorded, by model name.
        protocol: how the data were split and voxelised, for a tag.
        pictures: figures to attach to the parents of the models they show.
        study: the question the runs belong to, for a tag.
    """
    base = {"study": study, "dataset": dataset, "protocol": protocol}
    groups = []
    trainings = {model: results.of_model(model) for model in results.models}
    beside: dict[str, list[SeedResult]] = {BOOSTED_TREES: results.boosted_trees}
    observed = {}  # name of the model -> observer whose squares it has
    for name in results.observers:
        for found in (results.observer(name), results.trees_of_observer(name)):
            if found is not None:
                beside[found.model], observed[found.model] = [found], name
    for model, trained in (trainings | beside).items():
        if not trained:
            continue
        split = f"square_split/{observed[model]}" if model in observed else "split"
        source = (results.folder / split / "split.csv").as_posix()
        own = (settings or {}).get(model, {})
        key = f"{study}/{dataset}/{model}"
        children = [_seed_record(result, key, base, own, source) for result in trained]
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
    result: SeedResult, group: str, base: Mapping[str, str], own: Mapping[str, Any], source: str
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
            "target": result.evaluation.target,
            **origin_tags(provenance),
        },
        artifacts={f"model/{path.name}": path for path in result.model_files},
        drawings=_drawings(result),
        datasets=_datasets(result, base["dataset"], source),
        model=_model(result),
        seconds=result.seconds or 0.0,
    )


def _datasets(result: SeedResult, dataset: str, source: str) -> list[DatasetRecord]:
    """The crops that a model was trained, tuned and tested on; ``source`` lists the parts."""
    inputs = (result.provenance or {}).get("inputs")
    if not inputs:
        return []
    fingerprint = digest(inputs)
    tested = {"crops": result.evaluation.voxel.n_samples}
    return [
        DatasetRecord(f"{dataset}, training", fingerprint, source, "training"),
        DatasetRecord(
            f"{dataset}, validation", fingerprint, source, "validation", prefix="validation_"
        ),
        DatasetRecord(f"{dataset}, test", fingerprint, source, "test", tested, "test_"),
    ]


def data_of(
    dataset: str, tags: Mapping[str, str], prefix: str | None = None
) -> list[DatasetRecord]:
    """The data of a run of a study or an experiment, whose parts differ from run to run.

    Args:
        dataset: name of the data.
        tags: of ``origin_tags``; without them the data are unknown.
        prefix: beginning of the names of the metrics that were measured on the data.
    """
    fingerprint = tags.get("scenenet.data")
    return (
        [DatasetRecord(dataset, fingerprint, "", "training", prefix=prefix)] if fingerprint else []
    )


def _model(result: SeedResult) -> ModelRecord | None:
    if not result.model_files:
        return None
    tags = {"model": result.model, "kind": result.kind, "seed": str(result.seed)}
    tags["target"] = result.evaluation.target
    return ModelRecord(f"{result.model}-seed-{result.seed}", result.model_files[0], tags)


def origin_tags(provenance: Mapping[str, Any]) -> dict[str, str]:
    """Tags with the hash of the settings, the fingerprint of the data and the hash of the code.

    Args:
        provenance: record of a training, a study or an experiment; empty for no tags.
    """
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
    test, towers = result.evaluation.voxel, result.evaluation.towers
    metrics: dict[str, float | None] = {f"test_{n}": getattr(test, n) for n in DECISIVE_FIRST}
    metrics["test_average_precision"] = result.evaluation.average_precision
    if result.validation is not None:
        metrics |= {f"validation_{n}": getattr(result.validation, n) for n in DECISIVE_FIRST}
    metrics |= {f"towers_{name}": getattr(towers, name) for name in MATCH_SCORES}
    truth, points = result.evaluation.truth, result.evaluation.points
    if truth is not None:
        metrics |= {f"truth_{n}": getattr(truth.voxel, n) for n in DECISIVE_FIRST}
        metrics |= {f"truth_towers_{name}": getattr(truth.towers, name) for name in MATCH_SCORES}
    for prefix, found in (("points", points), ("truth_points", truth and truth.points)):
        if found is not None:
            metrics |= {f"{prefix}_{name}": getattr(found, name) for name in POINT_SCORES}
    metrics |= {"tau": test.tau, "alive": float(result.alive)}
    return metrics


def _drawings(result: SeedResult) -> dict[str, Any]:
    drawings: dict[str, Any] = {}
    if result.history is not None:
        history = result.history

        def draw_training(path: Path) -> None:
            from scenenet.figures.plots.curves import training

            training({f"seed {result.seed}": history}, path)

        drawings["figures/training.png"] = draw_training
    if result.evaluation.pr_curve:

        def draw_curve(path: Path) -> None:
            from scenenet.figures.plots.curves import precision_recall

            precision_recall({result.model: [result.evaluation.pr_curve]}, path)

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
    """Mean and spread over the seeds, share of live models, and the trivial baseline.

    MLflow draws a group as one line, so the parent needs metrics of its own. Means include dead
    models; ``test_f05_live_mean`` and similar metrics leave them out.
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
    trivial = [result.evaluation.voxel_trivial for result in trained]
    for name in SCORES:
        known = [value for s in trivial if (value := getattr(s, name)) is not None]
        metrics[f"trivial_{name}"] = fmean(known) if known else None
    if champion is not None:
        metrics["champion_seed"] = champion.seed
        best = champion.evaluation.voxel
        metrics |= {f"champion_test_{name}": getattr(best, name) for name in SCORES}
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
            "target": trained[0].evaluation.target,
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
        f"Summary over {len(trained)} {seeds}; {n_live} of the models are live (detect a tower "
        "voxel). `_mean` and `_std` are over all seeds, `_live_mean` over live models; "
        "`trivial_` is a model that never predicts tower; `champion_` is the seed with the "
        "highest F0.5 on the validation crops."
    )
