"""The best of each model, and of all, in MLflow's registry under the alias ``champion``."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scenenet.core import files
from scenenet.core.errors import InputError
from scenenet.results.folder import Results, SeedResult
from scenenet.tracking.store import TrackingSettings, exclusive, open_client, store_errors

if TYPE_CHECKING:
    from mlflow import MlflowClient
    from mlflow.entities.model_registry import ModelVersion

ALIAS = "champion"
FOLDER = "served"
"""Where a run keeps its model as it is pyfunc_model."""
DIGEST_TAG = "scenenet.digest"


def register_champions(
    settings: TrackingSettings, results: Results, dataset: str, runs: str | Path, record: str | Path
) -> dict[str, Any]:
    """Register the seed of each model that is best on validation, and the best of all models.

    The registry calls a model ``EXPERIMENT-MODEL``, and the best of all ``EXPERIMENT``. Another
    champion becomes a new version, and the alias moves to it; the same one stays as it is. Older
    versions are kept.

    Args:
        runs: record of ``log_runs``, to find the run of each seed.
        record: JSON file to write: name in the registry -> model, seed, version, run, and the
            address to load it by.

    Returns:
        what was written.

    Raises:
        InputError: a champion has no run in the store.
    """
    logged = files.read_json(runs)["runs"]
    registered: dict[str, Any] = {}
    with exclusive(settings.uri), store_errors(settings.uri):
        client = open_client(settings.uri)
        for name, champion in _champions(settings.experiment, results).items():
            key = f"reproduction/{dataset}/{champion.model}/seed-{champion.seed}"
            if key not in logged:
                raise InputError(
                    f"{champion.model} seed {champion.seed} has no run",
                    file=runs,
                    remedy="Delete the record and run the workflow again",
                )
            version = _registered(client, name, champion, logged[key]["run_id"])
            registered[name] = {
                "model": champion.model,
                "seed": champion.seed,
                "version": version.version,
                "run_id": logged[key]["run_id"],
                "load": f"models:/{name}@{ALIAS}",
            }
    files.write_json(record, registered)
    return registered


def _champions(experiment: str, results: Results) -> dict[str, SeedResult]:
    """Name in the registry -> the training that is best on validation."""
    champions = {
        f"{experiment}-{model}": best
        for model in results.models
        if (best := results.champion(model)) is not None
    }
    if champions:
        best = max(champions.values(), key=lambda champion: champion.validation["f05"])
        champions[experiment] = best
    return champions


def _registered(client: MlflowClient, name: str, champion: SeedResult, run_id: str) -> ModelVersion:
    """The version of this champion, made if it is not the current one already."""
    from mlflow.exceptions import MlflowException

    digest = files.digest([files.sha256(file) for file in champion.model_files] + [run_id])
    try:
        client.get_registered_model(name)
    except MlflowException:
        client.create_registered_model(name, description=_said())
    else:
        aliases = client.get_registered_model(name).aliases
        if ALIAS in aliases:
            current = client.get_model_version(name, aliases[ALIAS])
            if current.tags.get(DIGEST_TAG) == digest:
                return current
    with tempfile.TemporaryDirectory(prefix="scenenet-") as scratch:
        _save(Path(scratch) / FOLDER, champion)
        client.log_artifacts(run_id, str(Path(scratch) / FOLDER), FOLDER)
    source = f"{client.get_run(run_id).info.artifact_uri}/{FOLDER}"
    version = client.create_model_version(
        name, source, run_id, tags={**_tags(champion), DIGEST_TAG: digest}
    )
    client.set_registered_model_alias(name, ALIAS, version.version)
    return version


def _save(folder: Path, champion: SeedResult) -> None:
    import mlflow.pyfunc
    from mlflow.models import ModelSignature
    from mlflow.types import Schema, TensorSpec

    from scenenet.tracking import pyfunc_model

    grids = Schema([TensorSpec(np.dtype(np.float32), (-1, -1, -1, -1))])
    mlflow.pyfunc.save_model(
        folder,
        python_model=str(pyfunc_model.__file__),
        artifacts={"model": str(champion.model_files[0].resolve())},
        signature=ModelSignature(inputs=grids, outputs=grids),
        pip_requirements=["scenenet"],
    )


def _tags(champion: SeedResult) -> Mapping[str, str]:
    return {
        "model": champion.model,
        "seed": str(champion.seed),
        "validation_f05": f"{champion.validation['f05']:.4f}",
        "tau": f"{champion.validation['tau']:.6g}",
    }


def _said() -> str:
    return (
        "Probability of each voxel of a batch of grids (B, D, H, W) to hold a tower. The version "
        f"called {ALIAS} is the training with the highest F0.5 on validation; its tags say which."
    )
