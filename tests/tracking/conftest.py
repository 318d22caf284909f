"""A database with the tables of MLflow."""

from __future__ import annotations

from pathlib import Path

import pytest
from fixtures.made_once import made_once

from scenenet.tracking.database import create_database, exclusive


@pytest.fixture(scope="session")
def empty_database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """MLflow's tables without our experiments; creating them takes seconds, so they are copied."""

    def make(folder: Path) -> None:
        uri = f"sqlite:///{folder / 'mlflow.db'}"
        with exclusive(uri):
            create_database(uri)

    return made_once(tmp_path_factory, "mlflow", make) / "mlflow.db"
