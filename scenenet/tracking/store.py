"""The MLflow store: a database that is created before anything is logged, and its experiments."""

from __future__ import annotations

import contextlib
import os
import uuid
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote, urlparse

from pydantic import Field

from scenenet.core import files
from scenenet.core.errors import InputError
from scenenet.core.settings import Settings
from scenenet.tracking.database import (
    WAIT_S,
    DatabaseLockedError,
    create_database,
    database_error,
    database_of,
    exclusive,
    reading,
    require_schema,
)

if TYPE_CHECKING:
    from mlflow import MlflowClient
    from mlflow.entities import Experiment

STORE_TAG = "scenenet.store"
EXPERIMENT_TAGS = {"mlflow.experimentKind": "custom_model_development"}
"""Makes MLflow show the experiment as model training and not as language model work."""


class TrackingSettings(Settings):
    """The MLflow store."""

    run: bool = Field(
        True, description="log every training to MLflow, and register the best models"
    )
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
    settings: TrackingSettings,
    record: str | Path,
    experiments: Sequence[str] = (),
    request: str = "",
) -> dict[str, Any]:
    """Create the store and its experiments, unless they exist, before anything is logged.

    An existing store is kept with all its runs. Several processes may call this at once.

    Args:
        settings: where the store is.
        record: JSON file to write: uri, id of the store (a new database has a new id), request, and
            the id of each experiment.
        experiments: names of experiments in addition to that of ``settings``.
        request: of ``request_for``; written to the record.

    Returns:
        the content of ``record``.

    Raises:
        InputError: the store has the schema of another MLflow version, is not an MLflow store,
            is locked or damaged, cannot be reached, or was moved away from its artifacts.
    """
    with exclusive(settings.uri):
        create_database(settings.uri)
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
    written = {"uri": settings.uri, "store": store, "request": request, "experiments": ids}
    files.write_json(record, written)
    return written


def store_id(uri: str, wait_s: float = WAIT_S) -> str | None:
    """Id of the SQLite store at ``uri``; None for a server, and for a file without an id.

    Raises:
        InputError: the file does not exist, is empty, is locked or is damaged.
    """
    database = database_of(uri)
    if database is None:
        return None
    query = "SELECT value FROM experiment_tags WHERE key = ? ORDER BY experiment_id LIMIT 1"
    with reading(database, wait_s) as connection:
        tables = connection.execute("SELECT 1 FROM sqlite_master WHERE name = 'experiment_tags'")
        if tables.fetchone() is None:
            return None
        row = connection.execute(query, (STORE_TAG,)).fetchone()
    return None if row is None else row[0]


def request_for(uri: str, record: str | Path) -> str:
    """What the creation of the store is requested with; a new value requests it again.

    The value stays the same for as long as the store is the one of the record, and is another one
    if the store was removed, replaced or emptied. So the workflow can compare it with that of the
    last run. A store that is locked while the workflow plans is not looked at.

    Args:
        uri: of the store.
        record: the file that ``create_store`` wrote with this value; empty text if it is missing.
    """
    try:
        written = files.read_json(record)
        request, recorded = str(written["request"]), written["store"]
    except (OSError, ValueError, KeyError, TypeError):
        return ""
    if database_of(uri) is None:
        return request
    try:
        present = store_id(uri, wait_s=0.5)
    except DatabaseLockedError:
        return request
    except InputError:
        present = None
    return request if present == recorded else files.digest([request, recorded, present])


def check_same_store(uri: str, recorded: Mapping[str, Any], record: str | Path) -> None:
    """Check that a store exists and is the one that a record belongs to.

    Args:
        uri: of the store.
        recorded: content of the record, with ``uri`` and ``store``.
        record: the file of the record, for the message.

    Raises:
        InputError: it is another store, or the file does not exist, is empty, half made, locked or
            damaged.
    """
    if recorded["uri"] != uri:
        raise InputError(
            f"belongs to the MLflow store {recorded['uri']}, not to {uri}",
            file=record,
            remedy="Run the workflow again: it logs all runs to the store of the settings",
        )
    database = database_of(uri)
    if database is None or store_id(uri) == recorded["store"]:
        return
    require_schema(uri)
    raise InputError(
        f"is not the MLflow store that {record} belongs to",
        file=database,
        remedy="Put that store back; or run the workflow again: it logs all runs to this one",
    )


def open_client(uri: str) -> MlflowClient:
    os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")
    from mlflow import MlflowClient

    return MlflowClient(tracking_uri=uri)


def _experiment(client: MlflowClient, uri: str, name: str) -> Experiment:
    """The experiment, created if missing and restored if it was deleted in the UI."""
    database = database_of(uri)
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


@contextlib.contextmanager
def store_errors(uri: str) -> Iterator[None]:
    """Turn exceptions of MLflow and of its database into ``InputError``."""
    os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")
    from mlflow.exceptions import MlflowException
    from sqlalchemy.exc import SQLAlchemyError

    try:
        yield
    except (MlflowException, SQLAlchemyError) as error:
        database = database_of(uri)
        if database is not None and "sqlite3." in str(error):
            raise database_error(database, error) from error
        raise InputError(f"MLflow refused the store {uri} ({error})") from error
