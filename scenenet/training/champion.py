"""The choice of the seed on the validation part. Torch is not imported: files are compared."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from scenenet.core.files import atomic, read_json


def champion(
    models: Sequence[str | Path], tunings: Sequence[str | Path], out_model: str | Path
) -> dict[str, Any]:
    """Copy the model with the highest validation F0.5; the first of equals.

    Args:
        models, tunings: outputs of ``tune``, in the same order.
    """
    results = [read_json(path) for path in tunings]
    best = max(range(len(results)), key=lambda i: results[i]["validation"]["f05"] or 0.0)
    with atomic(out_model) as partial:
        shutil.copyfile(models[best], partial)
    return {"chosen": Path(models[best]).name, "validation": results[best]["validation"]}
