"""Logging runs so that a rerun replaces its run and never adds a twin.

A run is known by its key (``dataset/model/seed-3``) and by a digest of everything that is logged
in it. The same key and digest: the run stays as it is. Another digest: the new run is logged whole
and the old one deleted.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scenenet.core import files
from scenenet.core.errors import InputError
from scenenet.tracking.store import (
    TrackingSettings,
    check_same_store,
    check_schema,
    exclusive,
    open_client,
    store_errors,
)

if TYPE_CHECKING:
    from mlflow import MlflowClient
    from mlflow.entities import Run

KEY_TAG, GROUP_TAG, DIGEST_TAG = "scenenet.key", "scenenet.group", "scenenet.digest"
NOTE_TAG = "mlflow.note.content"
"""Where MLflow keeps the description of a run or of an experiment."""

METRICS_PER_BATCH, PARAMS_PER_BATCH = 1000, 100
"""What MLflow takes in one call."""


@dataclass(frozen=True)
class RunRecord:
    """Everything one MLflow run holds.

    Attributes:
        key: what it is the run of; unique in its experiment.
        name: the name people see.
        params: settings; values are written as text.
        metrics: final numbers. None and NaN are left out.
        history: measure -> value of each epoch, first epoch first.
        epochs: step of each value in ``history``.
        tags: what to filter by.
        artifacts: path in the run -> the file that is copied there.
        drawings: path in the run -> function that draws that file; what it draws must follow from
            the rest of the record, because only the rest enters the digest.
        seconds: how long the work took, shown as the duration of the run.
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
    seconds: float = 0.0

    def digest(self) -> str:
        """Digest of all that is logged; files by their content."""
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
            }
        )


@dataclass(frozen=True)
class RunGroup:
    """A parent run with its summary, and the runs under it."""

    parent: RunRecord
    children: Sequence[RunRecord]


def log_runs(
    settings: TrackingSettings,
    groups: Sequence[RunGroup],
    record: str | Path,
    store: str | Path | None = None,
    note: str = "",
) -> dict[str, Any]:
    """Bring the runs of ``groups`` into the store; what is there unchanged is not touched.

    Runs of the same groups that are no longer among the results are deleted, so that a parent's
    summary and the runs under it always tell the same. Nothing else in the store is touched.

    Args:
        settings: where the store is, and the experiment.
        groups: what to log.
        record: JSON file to write: key -> run id, digest and whether it was logged or kept.
        store: the record that ``create_store`` wrote; checked against the store if given.
        note: what the experiment says of itself.

    Returns:
        what was written.

    Raises:
        InputError: the store is not the one of the record, or as for ``create_store``.
    """
    if store is not None:
        check_same_store(settings, Path(store))
    runs: dict[str, Any] = {}
    with exclusive(settings.uri), store_errors(settings.uri):
        check_schema(settings.uri)
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
    written = {"uri": settings.uri, "experiment": settings.experiment, "runs": runs}
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
        client.delete_run(run.info.run_id)
    return logged


def _sync(
    client: MlflowClient,
    experiment: str,
    record: RunRecord,
    present: list[Run],
    extra_tags: Mapping[str, str],
) -> dict[str, str]:
    """Leave exactly one run of ``record`` among ``present``: the one there if it is equal."""
    digest = record.digest()
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
            client.delete_run(run.info.run_id)
    return {"run_id": run_id, "digest": digest, "status": status}


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
    # At step 0: MLflow shows the value with the highest step, and there is no other one. They come
    # before the history, because the plots of its comparison begin with the first metric.
    metrics = [
        Metric(name, float(value), end, 0)
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
    # The digest comes last: a run that was cut off has none and is replaced next time.
    client.set_tag(run_id, DIGEST_TAG, digest)
    client.set_terminated(run_id, "FINISHED", end)
    return run_id


def _log_artifacts(client: MlflowClient, run_id: str, record: RunRecord) -> None:
    for to, path in record.artifacts.items():
        folder = Path(to).parent.as_posix()
        client.log_artifact(run_id, str(path), None if folder == "." else folder)
    if not record.drawings:
        return
    with tempfile.TemporaryDirectory() as scratch:
        for to, draw in record.drawings.items():
            path = Path(scratch) / to
            path.parent.mkdir(parents=True, exist_ok=True)
            draw(path)
        client.log_artifacts(run_id, scratch)
