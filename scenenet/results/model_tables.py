"""Tables about models: times, parameters in metres, certificates (thesis 5.2.2, 5.2.6, 3.4).

As in ``scenenet.results.tables``: every function returns a data frame for one CSV, and spread is
the sample standard deviation over seeds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, NamedTuple

import pandas as pd

from scenenet.experiments.published import Thesis
from scenenet.interpretability.determination import determination
from scenenet.interpretability.parameter_sentences import Parameter, parameters_of, sentences
from scenenet.models.settings import BOOSTED_TREES
from scenenet.results.folder import Results
from scenenet.results.initial_models import initial_model

if TYPE_CHECKING:
    from scenenet.models.geneo_model import GeneoModel

SYMBOLS = {"sigma": "σ", "beta": "β", "omega": "ω", "lambda": "λ"}
"""Name of a parameter -> its symbol in the thesis."""


def times(results: Results, thesis: Thesis) -> pd.DataFrame:
    """Time and memory of training and of inference (thesis 5.2.6) on the machine of the run.

    ``useful_seconds`` is the expected time until a training gives a live model: the time of one
    training divided by the share of live models. ``inference_ms`` is of 64^3 voxels and
    ``inference_ms_128`` of 128^3 (``scenenet.evaluation.inference_time``), ``peak_memory_mb`` the
    largest over the seeds (``scenenet.core.peak_memory``).
    """
    columns = ["model", "n_seeds", "epochs", "training_seconds", "training_seconds_std",
               "seconds_per_epoch", "live_share", "useful_seconds", "peak_memory_mb",
               "inference_ms", "inference_ms_128", "thesis_training_seconds",
               "thesis_useful_seconds", "thesis_inference_ms"]  # fmt: skip
    rows: list[dict[str, Any]] = []
    for model, kind in results.models.items():
        trained = results.of_model(model)
        timed = [r for r in trained if r.seconds is not None]
        if not timed:
            continue
        epochs = pd.Series([r.epochs for r in timed], dtype=float)
        seconds = [float(r.seconds or 0) for r in timed]
        peaks = [r.resources.get("peak_memory_mb") for r in timed if r.resources]
        row = _training(seconds, sum(r.alive for r in trained) / len(trained))
        row |= {"model": model, "epochs": epochs.mean(), "peak_memory_mb": _largest(peaks)}
        row["seconds_per_epoch"] = sum(seconds) / epochs.sum()
        row |= _inference(results.timing(model))
        row["thesis_training_seconds"] = _scaled(thesis.value("times.training"), 60)
        row["thesis_useful_seconds"] = _scaled(thesis.value(f"times.{kind}.training_useful"), 3600)
        row["thesis_inference_ms"] = thesis.value(f"times.{kind}.inference")
        rows.append(row)
    trees = results.boosted_trees_times()
    if trees is not None:
        live = [r.alive for r in results.boosted_trees]
        row = _training(trees["training_seconds"], sum(live) / max(1, len(live)))
        row |= {"model": BOOSTED_TREES, "peak_memory_mb": trees.get("peak_memory_mb")}
        rows.append(row | _inference(trees))
    return pd.DataFrame(rows, columns=columns)


def parameters(results: Results, thesis: Thesis) -> pd.DataFrame:
    """The parameters of each SCENE-Net in metres, each with a sentence (Figure 5.5).

    Parameters in voxels are multiplied by the voxel size of the training. ``initial`` is the mean
    of the initial values over the seeds, ``initial_from`` says how they are known
    (``scenenet.results.initial_models``). ``source`` to ``determined`` say whether the data
    determine the number (``scenenet.interpretability.determination``); they are empty for models in
    voxels. A number that is not determined has no sentence.
    """
    from scenenet.geneo.sentences import Reference

    columns = ["model", "parameter", "symbol", "unit", "mean", "std", "n_seeds", "initial",
               "initial_from", "thesis", "source", "low", "high", "bound_met", "determined",
               "sentence"]  # fmt: skip
    rows: list[dict[str, Any]] = []
    for model in results.models:
        found = numbers_in_metres(results, model)
        if found is None:
            continue
        means = found.after.mean()
        reference = Reference(found.step, _tower_width(results))
        texts = sentences(found.network, means.to_dict(), reference)
        known = determination(found.networks)
        for parameter in found.parameters:
            name = parameter.name
            said = known.get(name)
            rows.append(
                {
                    "model": model,
                    "parameter": name,
                    "symbol": SYMBOLS.get(parameter.symbol, parameter.symbol),
                    "unit": parameter.unit,
                    "mean": means[name],
                    "std": found.after[name].std(),
                    "n_seeds": len(found.after),
                    "initial": found.before[name].mean() if name in found.before else None,
                    "initial_from": found.began,
                    "thesis": _scaled(_published(thesis, name), 0.01),
                    "source": None if said is None else said.source,
                    "low": None if said is None else said.low,
                    "high": None if said is None else said.high,
                    "bound_met": None if said is None else said.bound_met,
                    "determined": None if said is None else said.determined,
                    "sentence": texts[name] if said is None or said.determined else None,
                }
            )
    return pd.DataFrame(rows, columns=columns)


class Numbers(NamedTuple):
    """The parameters of a SCENE-Net from every seed, in metres.

    Attributes:
        networks: the trained models.
        parameters: names and units, in order.
        after: trained values, a row per seed and a column per parameter.
        before: the same for the initial models; no columns if they are unknown.
        began: how ``before`` is known.
        step: m, unit of the height of a kernel.
    """

    networks: list[GeneoModel]
    parameters: list[Parameter]
    after: pd.DataFrame
    before: pd.DataFrame
    began: str
    step: float

    @property
    def network(self) -> GeneoModel:
        """One of the trained models."""
        return self.networks[-1]


def numbers_in_metres(results: Results, model: str) -> Numbers | None:
    """The parameters of one SCENE-Net; None if it has no tuned file or is not a SCENE-Net."""
    from scenenet.models.geneo_model import GeneoModel
    from scenenet.models.model_file import read_model

    after, before, began, sizes = [], [], set(), []
    networks: list[GeneoModel] = []
    known: list[Parameter] = []
    for result in results.of_model(model):
        trained, card = read_model(result.model_files[0]) if result.model_files else (None, None)
        if not isinstance(trained, GeneoModel) or card is None:
            continue
        networks.append(trained)
        known = parameters_of(trained, card.voxel_size)
        after.append(_scaled_all(known, trained.shape_parameters()))
        sizes.append(card.voxel_size)
        start = initial_model(result, trained)
        if start is not None and isinstance(start.model, GeneoModel):
            before.append(_scaled_all(known, start.model.shape_parameters()))
            began.add(start.origin)
    if not networks:
        return None
    step = networks[-1].length_unit_m(sum(sizes) / len(sizes))
    origins = "; ".join(sorted(began))
    return Numbers(networks, known, pd.DataFrame(after), pd.DataFrame(before), origins, step)


def _scaled_all(known: Sequence[Parameter], values: Mapping[str, float]) -> dict[str, float]:
    return {parameter.name: parameter.factor * values[parameter.name] for parameter in known}


def certificate(results: Results, thesis: Thesis | None = None) -> pd.DataFrame:
    """Which properties of a GENEO the best seed of each model has, one row per property.

    ``value`` is the measured number, ``found`` the result in words.
    """
    columns = ["model", "kind", "seed", "property", "thesis", "holds", "value", "found"]
    rows = []
    for model in results.models:
        known = results.certificate(model)
        if known is None:
            continue
        for statement in known.statements:
            rows.append(
                {
                    "model": model,
                    "kind": known.kind,
                    "seed": known.seed,
                    "property": statement.property,
                    "thesis": statement.thesis,
                    "holds": statement.holds,
                    "value": statement.value,
                    "found": statement.text,
                }
            )
    return pd.DataFrame(rows, columns=columns)


def turns(results: Results, thesis: Thesis | None = None) -> pd.DataFrame:
    """Change of the output of each model when the scene is rotated about z, or shifted by half a
    voxel (``degrees`` empty); one row per rotation."""
    columns = ["model", "degrees", "mean_h", "mean_m", "largest_m", "decision_changed"]
    rows = []
    for model in results.models:
        known = results.certificate(model)
        moved = [] if known is None else [known.half_voxel, *known.turns]
        rows += [{"model": model} | asdict(one) for one in moved]
    return pd.DataFrame(rows, columns=columns)


def _training(seconds: Sequence[float], live_share: float) -> dict[str, Any]:
    each = pd.Series(seconds, dtype=float)
    return {
        "n_seeds": len(each),
        "training_seconds": each.mean(),
        "training_seconds_std": each.std(),
        "live_share": live_share,
        "useful_seconds": each.mean() / live_share if live_share else None,
    }


def _inference(timing: Mapping[str, Any] | None) -> dict[str, float | None]:
    took = {} if timing is None else timing["inference_ms"]
    return {"inference_ms": took.get("64"), "inference_ms_128": took.get("128")}


def _largest(values: Sequence[float | None]) -> float | None:
    return max((value for value in values if value is not None), default=None)


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else factor * value


def _published(thesis: Thesis, parameter: str) -> float | None:
    """The published value in per cent; only mixing weights have one."""
    return thesis.value(f"parameters.{parameter.replace('.', '_')}")


def _tower_width(results: Results) -> float | None:
    """Mean width of the labelled towers, m."""
    tables = [table for table in results.towers().values() if len(table)]
    return float(pd.concat(tables)["width"].mean()) if tables else None
