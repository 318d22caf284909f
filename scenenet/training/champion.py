"""The choice of the seed on the validation part. Torch is not imported: files are compared."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path

from scenenet.core.files import atomic, read_json
from scenenet.training.tuning_result import Tuning


def champion(
    models: Sequence[str | Path], tunings: Sequence[str | Path], out_model: str | Path
) -> Path:
    """Copy the model with the highest F0.5 on the validation crops, the first of equals.

    What counts is the answer that users get (``Tuning.decisive``).

    Args:
        models, tunings: outputs of ``tune``, in the same order.

    Returns:
        its file.
    """
    results = [Tuning.from_json(read_json(path)) for path in tunings]
    best = max(range(len(results)), key=lambda i: results[i].decisive)
    with atomic(out_model) as partial:
        shutil.copyfile(models[best], partial)
    return Path(models[best])
