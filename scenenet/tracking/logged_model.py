"""A tuned model as an MLflow logged model: signature, input example, requirements.

MLflow 3 lists logged models apart from runs, with the metrics, parameters and data sets that belong
to them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scenenet.core.scratch import scratch_folder

if TYPE_CHECKING:
    from mlflow import MlflowClient
    from mlflow.entities import Run

EXAMPLE_SHAPE = (2, 8, 8, 8)
"""(B, D, H, W) of the input example; a batch of two, so that the batch axis is not mistaken."""


@dataclass(frozen=True)
class ModelRecord:
    """A model to be logged with its run.

    Attributes:
        name: name in MLflow's list of models.
        file: the tuned model (``.json`` or ``.safetensors``).
        tags: what to filter by.
    """

    name: str
    file: Path
    tags: Mapping[str, str] = field(default_factory=dict)


def log_model(
    client: MlflowClient,
    experiment: str,
    run_id: str,
    record: ModelRecord,
    params: Mapping[str, Any],
) -> str:
    """Log a model as an output of a run.

    Args:
        client: of the store.
        experiment: id of the MLflow experiment.
        run_id: the run that trained the model.
        record: the model.
        params: settings of the training, shown with the model.

    Returns:
        id of the logged model.
    """
    from mlflow.entities import LoggedModelOutput

    logged = client.create_logged_model(
        experiment,
        name=record.name,
        source_run_id=run_id,
        tags=dict(record.tags),
        params={name: str(value) for name, value in params.items()},
        model_type="pyfunc",
    )
    with scratch_folder() as scratch:
        _save(scratch / "model", record.file, run_id, logged.model_id)
        client.log_model_artifacts(logged.model_id, str(scratch / "model"))
    client.finalize_logged_model(logged.model_id, "READY")
    client.log_outputs(run_id, [LoggedModelOutput(logged.model_id, 0)])
    return logged.model_id


def model_ids(run: Run) -> list[str]:
    """Ids of the models that were logged with a run."""
    outputs = run.outputs.model_outputs if run.outputs else []
    return [output.model_id for output in outputs or []]


def example() -> np.ndarray:
    """A batch of two small grids with a vertical line of occupied voxels, as ``EXAMPLE_SHAPE``."""
    grids = np.zeros(EXAMPLE_SHAPE, np.float32)
    grids[:, 1:7, 4, 4] = 1
    return grids


def _save(folder: Path, file: Path, run_id: str, model_id: str) -> None:
    import mlflow.pyfunc
    from mlflow.models import Model, ModelSignature
    from mlflow.types import Schema, TensorSpec

    from scenenet.tracking import pyfunc_model

    grids = Schema([TensorSpec(np.dtype(np.float32), (-1, -1, -1, -1))])
    mlflow.pyfunc.save_model(
        folder,
        python_model=str(pyfunc_model.__file__),
        artifacts={"model": str(file.resolve())},
        signature=ModelSignature(inputs=grids, outputs=grids),
        input_example=example(),
        # Named here, or MLflow would import the model in a new process to find them: 5 to 8 s.
        pip_requirements=["scenenet"],
        mlflow_model=Model(run_id=run_id, model_id=model_id),
    )
