"""Logging runs so that logging again replaces a run and never duplicates it.

A run is identified by its key (``dataset/model/seed-3``) and by a digest of everything that is
logged in it. If a run with the same key and digest exists, it stays unchanged. If the digest
differs, the new run is logged and the old one is deleted with its logged models.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scenenet.core import files
from scenenet.core.errors import InputError
from scenenet.core.scratch import scratch_folder
from scenenet.experiments.run_tables import TIMES
from scenenet.tracking.database import exclusive, require_schema
from scenenet.tracking.logged_model import ModelRecord, log_model, model_ids
from scenenet.tracking.store import (
    TrackingSettings,
    check_same_store,
    open_client,
    store_errors,
    store_id,
)

if TYPE_CHECKING:
    from mlflow import MlflowClient
    from mlflow.entities import Run

KEY_TAG, GROUP_TAG, DIGEST_TAG = "scenenet.key", "scenenet.group", "scenenet.digest"
SCORES_TAG = "scenenet.scores"
"""Digest of the final numbers of a run without times; two equal runs have the same."""
NOTE_TAG = "mlflow.note.content"
"""Where MLflow keeps the description of a run or of an experiment."""

METRICS_PER_BATCH, PARAMS_PER_BATCH = 1000, 100
"""What MLflow takes in one call."""


@dataclass(frozen=True)
class DatasetRecord:
    """Data that a run used, logged as an MLflow data set.

    Attributes:
        name: name in MLflow; unique among the data sets of a run.
        digest: fingerprint of the data.
        source: file that lists the data; empty if there is none.
        context: what the data were used for: ``training``, ``validation`` or ``test``.
        profile: facts about the data, such as the number of crops.
        prefix: beginning of the names of the metrics that were measured on it.
    """

    name: str
    digest: str
    source: str
    context: str
    profile: Mapping[str, Any] = field(default_factory=dict)
    prefix: str | None = None


@dataclass(frozen=True)
class RunRecord:
    """Everything that one MLflow run contains.

    Attributes:
        key: identifies the run; unique in its experiment.
        name: name that is shown.
        params: settings; values are written as text.
        metrics: final numbers. None and NaN are left out.
        history: measure -> value of each epoch, first epoch first.
        epochs: step of each value in ``history``.
        tags: what to filter by.
        artifacts: path in the run -> the file that is copied there.
        drawings: path in the run -> function that draws that file. The drawing must follow from the
            rest of the record, because only the rest enters the digest.
        datasets: data that the run used.
        model: the model that the run trained; logged as an MLflow logged model.
        seconds: duration of the work, shown as the duration of the run.
    """

    key: str
    name: str
    params: Mapping[str, Any] = field(default_factory=dict)
    metrics: Mapping[str, float | None] = field(default_factory=dict)
    history: Mapping[str, Sequence[float]] = field(default_factory=dict)
    epochs: Sequence[int] = ()
    tags: Mapping[str, str] = field(default_factory=dict)
    artifacts: Mapping[str, Path] = field(default_factory=dict)
    drawings: Mapping[str, Callable[[Path], object]] = field(default_factory=dict)
    datasets: Sequence[DatasetRecord] = ()
    model: ModelRecord | None = None
    seconds: float = 0.0

    def scores(self) -> str:
        """Digest of the final numbers without times; equal for two equal runs."""
        return files.digest(
            {name: repr(n) for name, n in self.metrics.items() if not name.startswith(TIMES)}
        )

    def digest(self) -> str:
        """Digest of everything that is logged; files by their content."""
        return files.digest(
            {
                "name": self.name,
                "params": {name: str(value) for name, value in self.params.items()},
                "metrics": {name: repr(value) for name, value in self.metrics.items()},
                "history": {n: [repr(float(v)) for v in vs] for n, vs in self.history.items()},
                "epochs": [int(epoch) for epoch in self.epochs],
                "tags": dict(self.tags),
                "artifacts": {to: files.sha256(path) for to, path in self.artifacts.items()},
                "drawings": sorted(self.drawings),
                "datasets": [asdict(dataset) for dataset in self.datasets],
                "model": None
                if self.model is None
                else [self.model.name, files.sha256(self.model.file), dict(self.model.tags)],
            }
        )


@dataclass(frozen=True)
class RunGroup:
    """A parent run with a summary, and the runs nested in it."""

    parent: RunRecord
    children: Sequence[RunRecord]


def log_runs(
    settings: TrackingSettings,
    groups: Sequence[RunGroup],
    record: str | Path,
    store: str | Path | None = None,
    note: str = "",
) -> dict[str, Any]:
    """Log the runs of ``groups`` to the store; unchanged runs stay as they are.

    Runs of the same groups that are no longer among the results are deleted, so that the summary of
    a parent always agrees with the runs nested in it. Nothing else in the store is changed.

    Args:
        settings: where the store is, and the experiment.
        groups: what to log.
        record: JSON file to write: key -> run id, digest, digest of the scores without times, and
            whether it was logged or kept.
        store: the record that ``create_store`` wrote; checked against the store if given.
        note: description of the experiment.

    Returns:
        the content of ``record``.

    Raises:
        InputError: the store is not the one of the record, was removed or replaced meanwhile, or as
            for ``create_store``.
    """
    made = None if store is None else files.read_json(store)
    runs: dict[str, Any] = {}
    with exclusive(settings.uri), store_errors(settings.uri):
        if made is not None:
            check_same_store(settings.uri, made, str(store))
        require_schema(settings.uri)
        logged_to = store_id(settings.uri)
        client = open_client(settings.uri)
        experiment = client.get_experiment_by_name(settings.experiment)
        if experiment is None:
            raise InputError(
                f"the MLflow store {settings.uri} has no experiment {settings.experiment!r}",
                remedy="Make the store first (rule mlflow_store)",
            )
        if note and experiment.tags.get(NOTE_TAG) != note:
            client.set_experiment_tag(experiment.experiment_id, NOTE_TAG, note)
        for group in groups:
            runs |= _log_group(client, experiment.experiment_id, group)
        written = {
            "uri": settings.uri,
            "store": logged_to,
            "experiment": settings.experiment,
            "runs": runs,
        }
        # MLflow writes to a removed file without an error, and the runs would be lost.
        check_same_store(settings.uri, written, record)
    files.write_json(record, written)
    return written


def _log_group(client: MlflowClient, experiment: str, group: RunGroup) -> dict[str, Any]:
    key = group.parent.key
    filter_string = f"tags.`{GROUP_TAG}` = '{key}'"
    present: dict[str, list[Run]] = {}
    for run in client.search_runs([experiment], filter_string, max_results=50_000):
        present.setdefault(run.data.tags[KEY_TAG], []).append(run)

    parent = _sync(client, experiment, group.parent, present.pop(key, []), {GROUP_TAG: key})
    under = {GROUP_TAG: key, "mlflow.parentRunId": parent["run_id"]}
    logged = {key: parent}
    for child in group.children:
        old = present.pop(child.key, [])
        logged[child.key] = _sync(client, experiment, child, old, under)
    for run in (run for runs in present.values() for run in runs):
        _delete(client, run)
    return logged


def _sync(
    client: MlflowClient,
    experiment: str,
    record: RunRecord,
    present: list[Run],
    extra_tags: Mapping[str, str],
) -> dict[str, str]:
    """Make sure that exactly one run of ``record`` exists: the present one if it is equal."""
    digest, scores = record.digest(), record.scores()
    extra_tags = {**extra_tags, SCORES_TAG: scores}
    kept = next((run for run in present if run.data.tags.get(DIGEST_TAG) == digest), None)
    if kept is None:
        run_id, status = _log(client, experiment, record, extra_tags, digest), "logged"
    else:
        run_id, status = kept.info.run_id, "kept"
        for name, value in extra_tags.items():
            if kept.data.tags.get(name) != value:
                client.set_tag(run_id, name, value)
    for run in present:
        if run is not kept:
            _delete(client, run)
    return {"run_id": run_id, "digest": digest, "scores": scores, "status": status}


def _delete(client: MlflowClient, run: Run) -> None:
    """Delete a run and the models that were logged with it; MLflow keeps their files."""
    for model in model_ids(run):
        client.delete_logged_model(model)
    client.delete_run(run.info.run_id)


def _log(
    client: MlflowClient,
    experiment: str,
    record: RunRecord,
    extra_tags: Mapping[str, str],
    digest: str,
) -> str:
    from mlflow.entities import Metric, Param

    end = int(time.time() * 1000)
    start = end - int(1000 * record.seconds)
    tags = {**record.tags, **extra_tags, KEY_TAG: record.key}
    run_id = client.create_run(experiment, start, tags, record.name).info.run_id

    last = max(record.epochs, default=0)
    _log_datasets(client, run_id, record.datasets)
    model = None
    if record.model is not None:
        model = log_model(client, experiment, run_id, record.model, record.params)
    # Final numbers have step 0: MLflow shows the value with the highest step, and they have no
    # other
    # one. They are logged before the history, because MLflow plots the first metric first.
    metrics = [
        Metric(name, float(value), end, 0, model, *_dataset_of(name, record.datasets))
        for name, value in record.metrics.items()
        if value is not None and value == value
    ]
    metrics += [
        Metric(name, float(value), start + (end - start) * epoch // max(1, last), int(epoch))
        for name, values in record.history.items()
        for epoch, value in zip(record.epochs, values, strict=True)
        if value == value
    ]
    params = [Param(name, str(value)) for name, value in record.params.items()]
    for i in range(0, len(metrics), METRICS_PER_BATCH):
        client.log_batch(run_id, metrics=metrics[i : i + METRICS_PER_BATCH])
    for i in range(0, len(params), PARAMS_PER_BATCH):
        client.log_batch(run_id, params=params[i : i + PARAMS_PER_BATCH])
    _log_artifacts(client, run_id, record)
    # The digest is logged last: an interrupted run has none and is replaced next time.
    client.set_tag(run_id, DIGEST_TAG, digest)
    client.set_terminated(run_id, "FINISHED", end)
    return run_id


def _log_datasets(client: MlflowClient, run_id: str, records: Sequence[DatasetRecord]) -> None:
    if not records:
        return
    from mlflow.entities import Dataset, DatasetInput, InputTag

    inputs = []
    for record in records:
        kind = "local" if record.source else "code"
        source: dict[str, Any] = {"uri": record.source} if record.source else {"tags": {}}
        profile = json.dumps(dict(record.profile))
        dataset = Dataset(record.name, record.digest, kind, json.dumps(source), profile=profile)
        inputs.append(DatasetInput(dataset, [InputTag("mlflow.data.context", record.context)]))
    client.log_inputs(run_id, inputs)


def _dataset_of(metric: str, records: Sequence[DatasetRecord]) -> tuple[str | None, str | None]:
    """Name and digest of the data that a metric was measured on; (None, None) if unknown."""
    for record in records:
        if record.prefix is not None and metric.startswith(record.prefix):
            return record.name, record.digest
    return None, None


def _log_artifacts(client: MlflowClient, run_id: str, record: RunRecord) -> None:
    for to, path in record.artifacts.items():
        folder = Path(to).parent.as_posix()
        client.log_artifact(run_id, str(path), None if folder == "." else folder)
    if not record.drawings:
        return
    with scratch_folder() as scratch:
        for to, draw in record.drawings.items():
            path = scratch / to
            path.parent.mkdir(parents=True, exist_ok=True)
            draw(path)
        client.log_artifacts(run_id, str(scratch))
