"""The MLflow store: a database made before anything logs, and the experiments in it."""

from __future__ import annotations

import contextlib
import os
import sqlite3
import subprocess
import sys
import uuid
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote, urlparse

from pydantic import Field

from scenenet.core import files
from scenenet.core.errors import InputError
from scenenet.core.settings import Settings

if TYPE_CHECKING:
    from mlflow import MlflowClient
    from mlflow.entities import Experiment

SQLITE = "sqlite:///"
STORE_TAG = "scenenet.dataset.zarr_store"
EXPERIMENT_TAGS = {"mlflow.experimentKind": "custom_model_development"}
"""Opens the experiment in MLflow's view of trainings instead of the one for language models."""


class TrackingSettings(Settings):
    """Where runs are logged."""

    uri: str = Field(
        "sqlite:///mlflow.db",
        min_length=1,
        description="MLflow tracking store: sqlite:///FILE or the address of an MLflow server",
    )
    experiment: str = Field(
        "scenenet", min_length=1, description="MLflow experiment the runs are listed under"
    )


def create_store(
    settings: TrackingSettings, record: str | Path, experiments: Sequence[str] = ()
) -> dict[str, Any]:
    """Make the store if there is none, and the experiments in it, before anything logs.

    A store that is there is kept with all its runs. Safe to call from several processes at once.

    Args:
        settings: where the store is.
        record: JSON file to write: uri, id of the store (another one when the database is made
            anew) and the id of each experiment.
        experiments: names of experiments beside the one of ``settings``.

    Returns:
        what was written.

    Raises:
        InputError: the store has the schema of another MLflow version, is no MLflow store, cannot
            be reached, or has been moved away from its artifacts.
    """
    with exclusive(settings.uri):
        _create_database(settings.uri)
        with store_errors(settings.uri):
            client = open_client(settings.uri)
            found = [_experiment(client, settings.uri, name)
                     for name in dict.fromkeys([settings.experiment, *experiments])]  # fmt: skip
            known = [e.tags[STORE_TAG] for e in found if STORE_TAG in e.tags]
            store = store_id(settings.uri) or next(iter(known), None) or uuid.uuid4().hex[:16]
            for experiment in found:
                if experiment.tags.get(STORE_TAG) != store:
                    client.set_experiment_tag(experiment.experiment_id, STORE_TAG, store)
    ids = {experiment.name: experiment.experiment_id for experiment in found}
    written = {"uri": settings.uri, "store": store, "experiments": ids}
    files.write_json(record, written)
    return written


def store_id(uri: str) -> str | None:
    """Id of the SQLite store at ``uri``; None where there is none yet, or for other stores.

    Reads one value and imports nothing heavy, so a workflow can ask while it plans.
    """
    database = _database(uri)
    if database is None or not database.is_file():
        return None
    query = "SELECT value FROM experiment_tags WHERE key = ? ORDER BY experiment_id LIMIT 1"
    try:
        with contextlib.closing(_open_to_read(database)) as connection:
            row = connection.execute(query, (STORE_TAG,)).fetchone()
    except sqlite3.Error:
        return None
    return None if row is None else row[0]


def check_same_store(settings: TrackingSettings, record: Path) -> None:
    written = files.read_json(record)
    present = store_id(settings.uri)
    other_uri = written["uri"] != settings.uri
    if other_uri or (_database(settings.uri) is not None and written["store"] != present):
        raise InputError(
            f"the MLflow store {settings.uri} is not the one this record is of",
            file=record,
            remedy="Delete the record and run the workflow again",
        )


def open_client(uri: str) -> MlflowClient:
    os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")
    from mlflow import MlflowClient

    return MlflowClient(tracking_uri=uri)


def _experiment(client: MlflowClient, uri: str, name: str) -> Experiment:
    """The experiment, made if missing and restored if someone deleted it in the UI."""
    database = _database(uri)
    expected = None if database is None else database.parent.resolve() / "mlartifacts" / name
    experiment = client.get_experiment_by_name(name)
    if experiment is None:
        location = None if expected is None else expected.as_uri()
        if expected is not None:
            expected.mkdir(parents=True, exist_ok=True)
        created = client.create_experiment(name, location, tags=dict(EXPERIMENT_TAGS))
        return client.get_experiment(created)
    if experiment.lifecycle_stage == "deleted":
        client.restore_experiment(experiment.experiment_id)
    if database is not None and expected is not None:
        _check_artifacts(database, experiment.artifact_location, expected)
    return client.get_experiment(experiment.experiment_id)


def _check_artifacts(database: Path, location: str, expected: Path) -> None:
    """MLflow writes absolute paths into its database, so a moved one points into nowhere."""
    parsed = urlparse(location)
    folder = Path(unquote(parsed.path))
    if parsed.scheme not in ("", "file") or folder.is_dir():
        return
    if folder.resolve() != expected:
        raise InputError(
            f"its artifacts are kept in {folder}, which is not there: the store was moved",
            file=database,
            remedy="Move it back, or set it aside; the runs are then logged anew from the results",
        )
    folder.mkdir(parents=True)


def _create_database(uri: str) -> None:
    """Make a SQLite database with MLflow's tables, unless there is one already."""
    database = _database(uri)
    if database is None or check_schema(uri):
        return
    database.parent.mkdir(parents=True, exist_ok=True)
    # In a process of its own: it sets up logging and migrations for the whole interpreter.
    done = subprocess.run(
        [sys.executable, "-m", "mlflow", "db", "upgrade", uri],
        capture_output=True,
        text=True,
        env={**os.environ, "MLFLOW_DISABLE_TELEMETRY": "true"},
    )
    if done.returncode:
        last = (done.stderr.strip() or done.stdout.strip()).splitlines()[-1:]
        raise InputError(f"the MLflow store could not be made ({''.join(last)})", file=database)


def check_schema(uri: str) -> bool:
    """Whether there is a database with tables; MLflow would migrate an older one unasked.

    Raises:
        InputError: its tables are those of another MLflow version, or not MLflow's.
    """
    database = _database(uri)
    if database is None:
        return True
    if not database.is_file() or database.stat().st_size == 0:
        return False
    try:
        with contextlib.closing(_open_to_read(database)) as connection:
            tables = {row[0] for row in connection.execute("SELECT name FROM sqlite_master")}
            if not tables:
                return False
            if not {"experiments", "alembic_version"} <= tables:
                raise InputError("is a database, but not one of MLflow", file=database)
            (revision,) = connection.execute("SELECT version_num FROM alembic_version").fetchone()
    except sqlite3.DatabaseError as error:
        raise InputError(f"is not an SQLite database ({error})", file=database) from None
    newest, known = _schema_revisions()
    if revision == newest:
        return True
    age = "an older" if revision in known else "a newer"
    remedy = (
        f"Make a copy of the file, then run: mlflow db upgrade {uri}"
        if revision in known
        else "Install the MLflow version that made it"
    )
    raise InputError(f"was made by {age} version of MLflow", file=database, remedy=remedy)


def _schema_revisions() -> tuple[str | None, set[str]]:
    """The schema of the installed MLflow, and all that came before."""
    import mlflow
    from alembic.script import ScriptDirectory

    script = ScriptDirectory(str(Path(mlflow.__file__).parent / "store" / "db_migrations"))
    return script.get_current_head(), {step.revision for step in script.walk_revisions()}


def _open_to_read(database: Path) -> sqlite3.Connection:
    return sqlite3.connect(f"{database.resolve().as_uri()}?mode=ro", uri=True)


def _database(uri: str) -> Path | None:
    """The file of a SQLite store; None for a server."""
    return Path(uri.removeprefix(SQLITE)) if uri.startswith(SQLITE) else None


@contextlib.contextmanager
def exclusive(uri: str) -> Iterator[None]:
    """One process at a time on a SQLite store; a server takes care of that itself."""
    database = _database(uri)
    if database is None:
        yield
        return
    import fcntl

    database.parent.mkdir(parents=True, exist_ok=True)
    with database.with_name(f"{database.name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


@contextlib.contextmanager
def store_errors(uri: str) -> Iterator[None]:
    """MLflow's own complaints about the store as errors of the input."""
    os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")
    from mlflow.exceptions import MlflowException

    try:
        yield
    except MlflowException as error:
        raise InputError(f"MLflow refused the store {uri} ({error})") from error
