"""The file of the MLflow store: created whole or not at all; each fault has its own message."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from fixtures.forked import tracker

from scenenet.core.errors import InputError
from scenenet.tracking import database
from scenenet.tracking.database import DatabaseLockedError, check_schema, reading
from scenenet.tracking.registry import register_champions
from scenenet.tracking.run_log import RunGroup, RunRecord, log_runs
from scenenet.tracking.store import STORE_TAG, TrackingSettings, create_store, request_for, store_id

KILLS = 4
CREATE = (
    "from scenenet.tracking.database import create_database, exclusive\n"
    "with exclusive('sqlite:///mlflow.db'): create_database('sqlite:///mlflow.db')"
)
CREATION_LIMIT_S = 300


def create_in_another_process(folder: Path, *arguments: str) -> None:
    """Create a store; ``arguments`` are its address, the file of the record and the request."""
    code = (
        "import sys; from scenenet.tracking.store import TrackingSettings, create_store;"
        "create_store(TrackingSettings(uri=sys.argv[1]), sys.argv[2], request=sys.argv[3])"
    )
    made = tracker().call(code, arguments, folder, os.environ, CREATION_LIMIT_S)
    assert made.returncode == 0, made.stderr


@pytest.fixture(scope="module")
def with_store(empty_database: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a store and its record, made in another process: MLflow keeps it open."""
    folder = tmp_path_factory.mktemp("store")
    shutil.copyfile(empty_database, folder / "mlflow.db")
    create_in_another_process(folder, "sqlite:///mlflow.db", "store.json", "")
    return folder


@pytest.fixture
def settings(with_store: Path, tmp_path: Path) -> TrackingSettings:
    """The settings of a copy of the store in ``tmp_path``, with its record beside it."""
    settings = TrackingSettings(uri=f"sqlite:///{tmp_path / 'mlflow.db'}")
    shutil.copyfile(with_store / "mlflow.db", tmp_path / "mlflow.db")
    record = (with_store / "store.json").read_text()
    (tmp_path / "store.json").write_text(record.replace("sqlite:///mlflow.db", settings.uri))
    return settings


def group(**more) -> RunGroup:
    return RunGroup(RunRecord(key="study/data/model", name="model", **more), [])


def log(settings: TrackingSettings, folder: Path, **more) -> dict:
    return log_runs(settings, [group(**more)], folder / "runs.json", folder / "store.json")


@contextlib.contextmanager
def locked(database: Path):
    connection = sqlite3.connect(database, isolation_level=None, check_same_thread=False)
    connection.execute("BEGIN EXCLUSIVE")
    try:
        yield
    finally:
        connection.execute("ROLLBACK")
        connection.close()


def half_made(database: Path) -> None:
    """A database as an interrupted ``mlflow db upgrade`` leaves it: old tables without rows."""
    with contextlib.closing(sqlite3.connect(database)) as connection:
        for table in ("experiments", "runs", "tags", "metrics", "params"):
            connection.execute(f"CREATE TABLE {table} (name TEXT)")
        connection.execute("CREATE TABLE alembic_version (version_num TEXT)")
        connection.execute("INSERT INTO alembic_version VALUES ('451aebb31d03')")
        connection.commit()


def test_a_half_made_store_is_created_from_scratch_and_a_killed_creation_leaves_none(tmp_path):
    database = tmp_path / "mlflow.db"
    half_made(database)
    assert not check_schema(f"sqlite:///{database}")

    def creating() -> subprocess.Popen:
        """A process that creates the store, as soon as it has begun."""
        process = subprocess.Popen(
            [sys.executable, "-c", CREATE], cwd=tmp_path, start_new_session=True
        )
        until = time.monotonic() + CREATION_LIMIT_S
        known = set(tmp_path.glob(".mlflow.db.*/.lock"))
        while not set(tmp_path.glob(".mlflow.db.*/.lock")) - known:
            assert process.poll() is None and time.monotonic() < until
            time.sleep(0.005)
        return process

    begin, first = time.monotonic(), creating()
    begin = time.monotonic()
    assert first.wait(CREATION_LIMIT_S) == 0
    lasts = time.monotonic() - begin
    assert check_schema(f"sqlite:///{database}")
    killed = 0
    for kill in range(KILLS):
        database.unlink(missing_ok=True)
        process = creating()
        time.sleep(lasts * kill / KILLS)
        os.killpg(process.pid, signal.SIGKILL)
        killed += process.wait() == -signal.SIGKILL
        assert not database.exists() or check_schema(f"sqlite:///{database}")
    assert killed >= KILLS // 2, "the kills came too late to test anything"
    database.unlink(missing_ok=True)
    assert creating().wait(CREATION_LIMIT_S) == 0
    assert check_schema(f"sqlite:///{database}")
    assert not list(tmp_path.glob(".mlflow.db.*")), "what the killed processes left is still there"


def test_the_schemas_that_mlflow_knows_are_those_of_its_migrations():
    import mlflow
    from alembic.script import ScriptDirectory

    script = ScriptDirectory(str(Path(mlflow.__file__).parent / "store" / "db_migrations"))
    newest, known = database._schema_revisions()
    assert newest == script.get_current_head()
    assert known == {step.revision for step in script.walk_revisions()}


def test_an_older_store_that_was_used_is_not_taken_for_a_half_made_one(tmp_path):
    half_made(tmp_path / "mlflow.db")
    with contextlib.closing(sqlite3.connect(tmp_path / "mlflow.db")) as connection:
        connection.execute("INSERT INTO experiments VALUES ('Default')")
        connection.commit()
    with pytest.raises(InputError, match="an older version of MLflow") as caught:
        check_schema(f"sqlite:///{tmp_path / 'mlflow.db'}")
    assert "mlflow db upgrade" in caught.value.remedy


def test_logging_to_a_half_made_store_is_refused(settings, tmp_path):
    (tmp_path / "mlflow.db").unlink()
    half_made(tmp_path / "mlflow.db")
    with pytest.raises(InputError, match=r"mlflow\.db: is half made.*Run the workflow again"):
        log(settings, tmp_path)


def test_a_missing_and_an_empty_store_are_named_so(settings, tmp_path):
    (tmp_path / "mlflow.db").write_bytes(b"")
    with pytest.raises(InputError, match=r"mlflow\.db: is empty. Run the workflow again"):
        log(settings, tmp_path)
    (tmp_path / "mlflow.db").unlink()
    with pytest.raises(InputError, match=r"mlflow\.db: does not exist. Run the workflow again"):
        log(settings, tmp_path)
    assert not (tmp_path / "mlflow.db").exists()


@pytest.mark.parametrize("at", [0, 5000])
def test_a_damaged_store_is_named_so_and_left_as_it_is(settings, tmp_path, at):
    database = tmp_path / "mlflow.db"
    content = bytearray(database.read_bytes())
    content[at : at + 4000] = b"\xff" * 4000
    # Every page but the first is broken, so that no query gets past it.
    if at:
        content[4096:] = b"\xff" * (len(content) - 4096)
    database.write_bytes(content)
    for attempt in (
        lambda: log(settings, tmp_path),
        lambda: create_store(settings, tmp_path / "store.json"),
    ):
        with pytest.raises(InputError, match=r"mlflow\.db: is damaged.*Put a copy of it back"):
            attempt()
    assert database.read_bytes() == content


def test_a_store_that_is_locked_for_seconds_is_waited_for(settings, tmp_path):
    opened = threading.Event()

    def hold() -> None:
        with locked(tmp_path / "mlflow.db"):
            opened.set()
            time.sleep(2)

    thread = threading.Thread(target=hold)
    thread.start()
    opened.wait()
    assert store_id(settings.uri) is not None
    thread.join()


def test_a_store_that_stays_locked_is_named_so(settings, tmp_path):
    with (
        locked(tmp_path / "mlflow.db"),
        pytest.raises(DatabaseLockedError, match=r"mlflow\.db: is locked by another program"),
        reading(tmp_path / "mlflow.db", wait_s=0.1) as connection,
    ):
        connection.execute("SELECT 1 FROM experiments")
    assert log(settings, tmp_path)["runs"]


def test_a_store_removed_while_runs_are_logged_is_an_error(settings, tmp_path):
    """MLflow goes on writing to the removed file, so nothing else would show the loss."""

    def remove(path: Path) -> None:
        (tmp_path / "mlflow.db").unlink()
        path.write_text("picture")

    with pytest.raises(InputError, match=r"mlflow\.db: (does not exist|is empty|was removed)"):
        log(settings, tmp_path, drawings={"picture.txt": remove})
    assert not (tmp_path / "runs.json").exists()


def test_registering_in_another_store_than_the_runs_are_in_says_what_to_do(
    settings, results, tmp_path
):
    log(settings, tmp_path)
    arguments = (settings, results, "data", tmp_path / "runs.json", tmp_path / "registry.json")
    with contextlib.closing(sqlite3.connect(tmp_path / "mlflow.db")) as connection:
        connection.execute("UPDATE experiment_tags SET value = 'other' WHERE key = ?", [STORE_TAG])
        connection.commit()
    with pytest.raises(InputError, match=r"runs\.json belongs to.*run the workflow again"):
        register_champions(*arguments)
    (tmp_path / "mlflow.db").unlink()
    with pytest.raises(InputError, match=r"mlflow\.db: does not exist. Run the workflow again"):
        register_champions(*arguments)


def test_the_creation_is_requested_again_only_if_the_store_is_another(settings, tmp_path):
    record, database = tmp_path / "store.json", tmp_path / "mlflow.db"
    assert request_for(settings.uri, tmp_path / "missing.json") == ""
    first = request_for(settings.uri, record)
    create_store(settings, record, request=first)
    assert request_for(settings.uri, record) == first
    log(settings, tmp_path)
    assert request_for(settings.uri, record) == first
    with locked(database):
        assert request_for(settings.uri, record) == first
    kept = database.read_bytes()
    database.unlink()
    again = request_for(settings.uri, record)
    assert again != first
    database.write_bytes(b"")
    assert request_for(settings.uri, record) == again
    # The store is made anew with that request: it is not requested once more.
    database.write_bytes(kept)
    with contextlib.closing(sqlite3.connect(database)) as connection:
        connection.execute("UPDATE experiment_tags SET value = 'new' WHERE key = ?", [STORE_TAG])
        connection.commit()
    replaced = request_for(settings.uri, record)
    assert replaced not in (first, again)
    # In another process, as the next run of the workflow: MLflow keeps the first file open.
    create_in_another_process(tmp_path, settings.uri, str(record), replaced)
    assert request_for(settings.uri, record) == replaced


def test_a_server_is_not_asked_while_the_workflow_plans(tmp_path):
    record = tmp_path / "store.json"
    record.write_text('{"uri": "http://nowhere:1", "store": "a", "request": "r"}')
    assert request_for("http://nowhere:1", record) == "r"
