"""Which numbers of a SCENE-Net in metres can be read, by several seeds (docs/method/numbers.md)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from scenenet.models.geneo_model import GeneoModel

SEEDS = 0.8
"""Share of the seeds that have to agree: four of five."""


class Determination(NamedTuple):
    """What several seeds say about one number.

    Attributes:
        source: ``points``, ``score`` or ``fixed`` (``scenenet.models.evidence``).
        low, high: medians over the seeds of the values that the data allow.
        spread: standard deviation over the seeds as a share of the mean; None for one seed.
        bound_met: share of the seeds in which it lies at a bound of its range.
        determined: whether at least ``SEEDS`` of the seeds determine it and lie within 30 % of the
            median over the seeds.
    """

    source: str
    low: float
    high: float
    spread: float | None
    bound_met: float
    determined: bool


def determination(models: Sequence[GeneoModel]) -> dict[str, Determination]:
    """What the models of several seeds say about each number, by name; empty without evidence."""
    # Imported here because the names of tables must be available without loading torch.
    from scenenet.models.evidence import WITHIN
    from scenenet.models.metric_scenenet import MetricSceneNet

    trained = [m for m in models if isinstance(m, MetricSceneNet) and m.evidence]
    if not trained:
        return {}
    found = {}
    for name in trained[0].evidence:
        said = [model.evidence[name] for model in trained]
        values = np.array([model.shape_parameters()[name] for model in trained])
        near = np.abs(values / np.median(values) - 1) <= WITHIN
        agreed = np.mean([ok and one.determined for ok, one in zip(near, said, strict=True)])
        spread = float(values.std(ddof=1) / values.mean()) if len(values) > 1 else None
        found[name] = Determination(
            source=said[0].source,
            low=float(np.median([one.low for one in said])),
            high=float(np.median([one.high for one in said])),
            spread=spread,
            bound_met=float(np.mean([one.at_bound for one in said])),
            determined=bool(agreed >= SEEDS),
        )
    return found
