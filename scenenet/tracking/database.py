"""The SQLite file of an MLflow store: its state, its creation, and the lock of its writers.

Nothing heavy is imported, so that the workflow can look at the file while it plans.
"""

from __future__ import annotations

import contextlib
import importlib.util
import os
import re
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from scenenet.core.errors import InputError
from scenenet.core.files import atomic

SQLITE = "sqlite:///"

WAIT_S = 20.0
"""Longest wait, s, for another program that has locked the file; that of MLflow itself."""

MADE_AGAIN = "Run the workflow again: it creates the store and logs all runs again from the results"
"""Remedy where the store has no runs that could be lost."""

WITHOUT_RUNS = frozenset({"alembic_version", "workspaces"})
"""Tables of MLflow that have rows before the store is used for the first time."""

UPGRADE = "import sys; from mlflow.db import commands; commands(['upgrade', sys.argv[1]])"
"""``mlflow db upgrade`` without the other commands of MLflow, whose import takes 2 s."""

REVISION = re.compile(r"""^(revision|down_revision)\b[^=]*= *["'](\w+)["']""", re.MULTILINE)
"""In a migration of MLflow: the schema that it makes, and the one that it begins with."""


class DatabaseLockedError(InputError):
    """Another program has locked the file for longer than the wait."""


def database_of(uri: str) -> Path | None:
    """The file of an SQLite store; None for a server."""
    return Path(uri.removeprefix(SQLITE)) if uri.startswith(SQLITE) else None


@contextlib.contextmanager
def exclusive(uri: str) -> Iterator[None]:
    """Lock an SQLite store for one process of this package; a server does that itself."""
    database = database_of(uri)
    if database is None:
        yield
        return
    import fcntl

    database.parent.mkdir(parents=True, exist_ok=True)
    with database.with_name(f"{database.name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


@contextlib.contextmanager
def reading(database: Path, wait_s: float = WAIT_S) -> Iterator[sqlite3.Connection]:
    """A connection that cannot write.

    Args:
        database: the file.
        wait_s: s, longest wait for another program.

    Raises:
        InputError: the file does not exist, is empty, is locked or is damaged.
    """
    if not database.is_file():
        raise InputError("does not exist", file=database, remedy=MADE_AGAIN)
    if database.stat().st_size == 0:
        raise InputError("is empty", file=database, remedy=MADE_AGAIN)
    address = f"{database.resolve().as_uri()}?mode=ro"
    try:
        with contextlib.closing(sqlite3.connect(address, wait_s, uri=True)) as connection:
            yield connection
    except sqlite3.DatabaseError as error:
        raise database_error(database, error) from None


def database_error(database: Path, error: Exception) -> InputError:
    """What an error of SQLite says about the file, and the remedy."""
    text = str(error)
    if "database is locked" in text or "database table is locked" in text:
        return DatabaseLockedError(
            "is locked by another program",
            file=database,
            remedy="Wait until that program has finished, or end it, and run again",
        )
    if "disk is full" in text or "disk I/O error" in text:
        return InputError(
            f"cannot be written ({text})",
            file=database,
            remedy="Free space on its disk, and run again",
        )
    if "no such table" in text or "readonly database" in text or "unable to open" in text:
        return InputError(
            f"was removed or replaced while it was in use, or cannot be written ({text})",
            file=database,
            remedy=MADE_AGAIN,
        )
    return InputError(
        f"is damaged, or is not an SQLite database ({text})",
        file=database,
        remedy="Put a copy of it back, or move it away: the workflow then creates the store and "
        "logs all runs again from the results",
    )


def check_schema(uri: str) -> bool:
    """Whether the store has the tables of the installed MLflow.

    False for a file that is missing, empty, or half made: its creation was interrupted, so it has
    tables of an earlier schema and no rows in them. MLflow would migrate an older store without
    asking, so that is refused.

    Raises:
        InputError: the tables are of another MLflow version, or not of MLflow; or the file is
            locked or damaged.
    """
    database = database_of(uri)
    if database is None:
        return True
    if not database.is_file() or database.stat().st_size == 0:
        return False
    with reading(database) as connection:
        query = "SELECT name FROM sqlite_master WHERE type = 'table' AND name NOT LIKE 'sqlite_%'"
        tables = {row[0] for row in connection.execute(query)}
        if not tables:
            return False
        if not tables & {"experiments", "alembic_version"}:
            raise InputError(
                "is a database, but not of MLflow",
                file=database,
                remedy="Name another file in tracking.uri",
            )
        revision = None
        if "alembic_version" in tables:
            revision = next(iter(connection.execute("SELECT version_num FROM alembic_version")), "")
        newest, known = _schema_revisions()
        if revision and revision[0] == newest:
            return True
        if not revision or revision[0] in known:
            if not _has_rows(connection, tables - WITHOUT_RUNS):
                return False
            remedy = f"Make a copy of the file, then run: mlflow db upgrade {uri}"
            raise InputError(
                "was created by an older version of MLflow", file=database, remedy=remedy
            )
    raise InputError(
        "was created by a newer version of MLflow",
        file=database,
        remedy="Install the MLflow version that created it",
    )


def require_schema(uri: str) -> None:
    """Check that a store can be used.

    Raises:
        InputError: it does not exist, is empty or half made, or as ``check_schema``.
    """
    database = database_of(uri)
    if database is None:
        return
    with reading(database):
        pass
    if not check_schema(uri):
        problem = "is half made: its creation was interrupted"
        raise InputError(problem, file=database, remedy=MADE_AGAIN)


def create_database(uri: str) -> None:
    """Create an SQLite database with the tables of MLflow, unless it exists.

    It appears under its name when it is complete. The caller holds the lock ``exclusive``.

    Raises:
        InputError: as ``check_schema``, or MLflow cannot create it.
    """
    database = database_of(uri)
    if database is None or check_schema(uri):
        return
    with atomic(database) as partial:
        # In a separate process, because it configures logging and migrations for the interpreter.
        done = subprocess.run(
            [sys.executable, "-c", UPGRADE, f"{SQLITE}{partial.resolve()}"],
            capture_output=True,
            text=True,
            env={**os.environ, "MLFLOW_DISABLE_TELEMETRY": "true"},
        )
        if done.returncode:
            last = (done.stderr.strip() or done.stdout.strip()).splitlines()[-1:]
            raise InputError(
                f"the MLflow store could not be created ({''.join(last)})", file=database
            )


def _has_rows(connection: sqlite3.Connection, tables: set[str]) -> bool:
    return any(
        connection.execute(f'SELECT 1 FROM "{table}" LIMIT 1').fetchone() for table in tables
    )


@cache
def _schema_revisions() -> tuple[str | None, set[str]]:
    """The schema of the installed MLflow, and all schemas that it knows.

    Its migrations are read as text: to run them imports MLflow, which takes seconds.
    """
    mlflow = importlib.util.find_spec("mlflow")
    if mlflow is None or mlflow.origin is None:
        raise ModuleNotFoundError("No module named 'mlflow'", name="mlflow")
    steps = Path(mlflow.origin).parent / "store" / "db_migrations" / "versions"
    before = {}
    for step in steps.glob("*.py"):
        numbers = dict(REVISION.findall(step.read_text(encoding="utf-8")))
        if "revision" in numbers:
            before[numbers["revision"]] = numbers.get("down_revision")
    newest = before.keys() - before.values()
    return next(iter(newest), None), set(before)
