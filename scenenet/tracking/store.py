"""The MLflow store: a database that is created before anything is logged, and its experiments."""

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
"""Makes MLflow show the experiment as model training and not as language model work."""


class TrackingSettings(Settings):
    """The MLflow store."""

    uri: str = Field(
        "sqlite:///mlflow.db",
        min_length=1,
        description="MLflow tracking store: sqlite:///FILE or the address of an MLflow server",
    )
    experiment: str = Field("scenenet", min_length=1, description="name of the MLflow experiment")


def experiment_of(settings: TrackingSettings, study: str) -> TrackingSettings:
    """The tracking settings with the MLflow experiment of a study or an experiment."""
    return settings.model_copy(update={"experiment": f"{settings.experiment}-{study}"})


def create_store(
    settings: TrackingSettings, record: str | Path, experiments: Sequence[str] = ()
) -> dict[str, Any]:
    """Create the store and its experiments, unless they exist, before anything is logged.

    An existing store is kept with all its runs. Several processes may call this at once.

    Args:
        settings: where the store is.
        record: JSON file to write: uri, id of the store (a new database has a new id) and the id of
            each experiment.
        experiments: names of experiments in addition to that of ``settings``.

    Returns:
        the content of ``record``.

    Raises:
        InputError: the store has the schema of another MLflow version, is not an MLflow store,
            cannot be reached, or was moved away from its artifacts.
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
    """Id of the SQLite store at ``uri``; None if it does not exist yet, and for other stores.

    Reads one value and imports nothing heavy, so that the workflow can call it while it plans.
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
    """Check that a store is the one that ``create_store`` recorded.

    Raises:
        InputError: it is another store.
    """
    written = files.read_json(record)
    present = store_id(settings.uri)
    other_uri = written["uri"] != settings.uri
    if other_uri or (_database(settings.uri) is not None and written["store"] != present):
        raise InputError(
            f"the MLflow store {settings.uri} is not the one of this record",
            file=record,
            remedy="Delete the record and run the workflow again",
        )


def open_client(uri: str) -> MlflowClient:
    os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")
    from mlflow import MlflowClient

    return MlflowClient(tracking_uri=uri)


def _experiment(client: MlflowClient, uri: str, name: str) -> Experiment:
    """The experiment, created if missing and restored if it was deleted in the UI."""
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
    """Refuse a moved database: MLflow stores absolute paths of artifacts in it."""
    parsed = urlparse(location)
    folder = Path(unquote(parsed.path))
    if parsed.scheme not in ("", "file") or folder.is_dir():
        return
    if folder.resolve() != expected:
        raise InputError(
            f"its artifacts are in {folder}, which does not exist: the store was moved",
            file=database,
            remedy="Move it back, or rename it; the runs are then logged again from the results",
        )
    folder.mkdir(parents=True)


def _create_database(uri: str) -> None:
    """Create an SQLite database with the tables of MLflow, unless it exists."""
    database = _database(uri)
    if database is None or check_schema(uri):
        return
    database.parent.mkdir(parents=True, exist_ok=True)
    # In a separate process, because it configures logging and migrations for the interpreter.
    done = subprocess.run(
        [sys.executable, "-m", "mlflow", "db", "upgrade", uri],
        capture_output=True,
        text=True,
        env={**os.environ, "MLFLOW_DISABLE_TELEMETRY": "true"},
    )
    if done.returncode:
        last = (done.stderr.strip() or done.stdout.strip()).splitlines()[-1:]
        raise InputError(f"the MLflow store could not be created ({''.join(last)})", file=database)


def check_schema(uri: str) -> bool:
    """Whether the database has tables. MLflow would migrate an older one without asking.

    Raises:
        InputError: its tables are of another MLflow version, or not of MLflow.
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
                raise InputError("is a database, but not of MLflow", file=database)
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
        else "Install the MLflow version that created it"
    )
    raise InputError(f"was created by {age} version of MLflow", file=database, remedy=remedy)


def _schema_revisions() -> tuple[str | None, set[str]]:
    """The schema of the installed MLflow, and all earlier ones."""
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
    """Lock an SQLite store for one process; a server does that itself."""
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
    """Turn exceptions of MLflow about the store into ``InputError``."""
    os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")
    from mlflow.exceptions import MlflowException

    try:
        yield
    except MlflowException as error:
        raise InputError(f"MLflow refused the store {uri} ({error})") from error
