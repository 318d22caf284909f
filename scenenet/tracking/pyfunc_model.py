"""A tuned model in the form that MLflow serves: voxel grids in, probabilities out.

MLflow stores this file with the model file and runs it when the model is loaded. So there is no
pickle, and ``mlflow.pyfunc.load_model`` needs only the package.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from mlflow.models import set_model
from mlflow.pyfunc import PythonModel


class TowerModel(PythonModel):
    """Probability of each voxel to contain a tower (thesis 4.3)."""

    def load_context(self, context: Any) -> None:
        from scenenet.models.model_file import read_model

        self.model, self.card = read_model(context.artifacts["model"])

    def predict(
        self, context: Any, model_input: np.ndarray, params: dict[str, Any] | None = None
    ) -> np.ndarray:
        """Probabilities of a batch of any size.

        Args:
            model_input: (B, D, H, W) measurement phi of each voxel, 0 if it is empty; axes
                z (up), y, x. Presence or density, in voxels of the size of the training.

        Returns:
            (B, D, H, W) float32 in [0, 1]; the tower voxels are those of at least the model's tau.
        """
        from scenenet.convolution.occupancy import Occupancy
        from scenenet.models.predictions import volumes

        grids = np.asarray(model_input)
        if grids.ndim != 4:
            raise ValueError(f"a batch of grids is (B, D, H, W), not {grids.shape}")
        flat = grids.reshape(len(grids), -1)
        indices = [np.flatnonzero(grid) for grid in flat]
        values = [grid[index] for grid, index in zip(flat, indices, strict=True)]
        shape = (grids.shape[1], grids.shape[2], grids.shape[3])
        occupancy = Occupancy.of_grids(indices, values, shape)
        return volumes(self.model, occupancy, self.card.voxel_size)


set_model(TowerModel())
