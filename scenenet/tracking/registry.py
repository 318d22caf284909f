"""The best seed of each model, and of all models, in MLflow's registry with alias ``champion``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scenenet.core import files
from scenenet.core.errors import InputError
from scenenet.metrics.score_columns import score_text
from scenenet.results.folder import Results
from scenenet.results.seed_result import SeedResult
from scenenet.tracking.database import exclusive, require_schema
from scenenet.tracking.logged_model import model_ids
from scenenet.tracking.store import (
    TrackingSettings,
    check_same_store,
    open_client,
    store_errors,
)

if TYPE_CHECKING:
    from mlflow import MlflowClient
    from mlflow.entities.model_registry import ModelVersion

ALIAS = "champion"
DIGEST_TAG = "scenenet.digest"


def register_champions(
    settings: TrackingSettings, results: Results, dataset: str, runs: str | Path, record: str | Path
) -> dict[str, Any]:
    """Register the logged model of the best seed of each model, and of the best of all models.

    Best means the highest F0.5 on the validation crops. The name of a model in the registry is
    ``EXPERIMENT-MODEL``, that of the best of all ``EXPERIMENT``. A new champion becomes a new
    version, and the alias moves to it; an unchanged one gets no new version. Older versions are
    kept.

    Args:
        settings: where the store is.
        results: the result folder.
        dataset: name of the data, part of the key of every run.
        runs: record of ``log_runs``, to find the run of each seed.
        record: JSON file to write: name in the registry -> model, seed, version, run, and the
            URI to load it with.

    Returns:
        the content of ``record``.

    Raises:
        InputError: a champion has no run in the store, or the store is not the one that the runs
            were logged to.
    """
    recorded = files.read_json(runs)
    logged = recorded["runs"]
    registered: dict[str, Any] = {}
    with exclusive(settings.uri), store_errors(settings.uri):
        check_same_store(settings.uri, recorded, runs)
        require_schema(settings.uri)
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
        best = max(champions.values(), key=lambda champion: champion.decisive)
        champions[experiment] = best
    return champions


def _registered(client: MlflowClient, name: str, champion: SeedResult, run_id: str) -> ModelVersion:
    """The version of this champion, created unless it is the current one."""
    from mlflow.exceptions import MlflowException

    digest = files.digest([files.sha256(file) for file in champion.model_files] + [run_id])
    try:
        client.get_registered_model(name)
    except MlflowException:
        client.create_registered_model(name, description=_description())
    else:
        aliases = client.get_registered_model(name).aliases
        if ALIAS in aliases:
            current = client.get_model_version(name, aliases[ALIAS])
            if current.tags.get(DIGEST_TAG) == digest:
                return current
    (model_id,) = model_ids(client.get_run(run_id))
    source = client.get_logged_model(model_id).artifact_location
    version = client.create_model_version(
        name, source, run_id, tags={**_tags(champion), DIGEST_TAG: digest}, model_id=model_id
    )
    client.set_registered_model_alias(name, ALIAS, version.version)
    return version


def _tags(champion: SeedResult) -> Mapping[str, str]:
    validation = champion.validation
    assert validation is not None  # a champion is tuned
    return {
        "model": champion.model,
        "seed": str(champion.seed),
        "validation_f05": score_text(validation.f05, 4),
        "tau": f"{validation.tau:.6g}",
    }


def _description() -> str:
    return (
        "Probability of each voxel of a batch of grids (B, D, H, W) to hold a tower. The version "
        f"with alias {ALIAS} is the training with the highest F0.5 on validation; see its tags."
    )
