"""Which numbers of a trained SCENE-Net the training crops determine (docs/method/numbers.md)."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from scenenet.models.evidence import Evidence
from scenenet.models.metric_scenenet import MetricSceneNet
from scenenet.training.measured_numbers import Measured

LOST = 0.01
"""Loss of F0.5 that is too small to prefer one value over another: two seeds differ by as much."""

STEPS = 24
"""Values between the bounds of a number at which the score is measured."""

HALVINGS = 3
"""How often the last step is halved."""

WEIGHTS = 1e-3, 0.999
"""Mixing weights between which the score is measured."""

NOTHING = 1e-5
"""Sum of mixing weights that is rounding."""


def evidence(
    model: MetricSceneNet, measured: Mapping[str, Measured], score: Callable[[], float]
) -> dict[str, Evidence]:
    """What the training crops say about each number of ``model``.

    Args:
        measured: from ``scenenet.training.measured_numbers.measure``.
        score: F0.5 of the model with its present numbers, as the search weighs it.
    """
    found = {}
    fixed = model.fixed_numbers()
    values = model.shape_parameters()
    best = score()
    shapes = [
        (f"{prefix}{name}.{parameter.name}", model.bounds_of(parameter))
        for prefix, stage in model.stages()
        for name, parameter in stage.shape_list()
    ]
    for label, bounds in shapes:
        value = values[label]
        if label in measured:
            between = measured[label].low, measured[label].high
            found[label] = Evidence.of("points", value, between, bounds)
        elif label in fixed:
            found[label] = Evidence.of("fixed", value, (value, value), bounds)
        else:
            between = _profile(model, label, bounds, best, score)
            found[label] = Evidence.of("score", value, between, bounds)
    weights = [
        f"{prefix}lambda.{name}"
        for prefix, stage in model.stages()
        for name in (stage.names if len(stage.names) > 1 else ())
    ]
    for label in weights:
        between = _profile(model, label, WEIGHTS, best, score)
        found[label] = Evidence.of("score", values[label], between, WEIGHTS)
    model.set_shape_parameters(values)
    return found


def _profile(
    model: MetricSceneNet,
    label: str,
    bounds: tuple[float, float],
    best: float,
    score: Callable[[], float],
) -> tuple[float, float]:
    """The lowest and the highest value of a number, with all values between them, at which the
    score is hardly lower than ``best``. The other numbers are kept; weights keep their ratios."""
    values = model.shape_parameters()
    at = values[label]

    def between(good: float, bad: float) -> float:
        """The last value from ``good`` towards ``bad`` at which the score is hardly lower."""
        for _ in range(HALVINGS):
            middle = float(np.sqrt(good * bad))
            model.set_shape_parameters(_changed(values, label, middle))
            good, bad = (good, middle) if score() < best - LOST else (middle, bad)
        return good

    tried = np.geomspace(*bounds, STEPS)
    ends = []
    for outwards in (tried[tried < at][::-1], tried[tried > at]):
        end = at
        for value in outwards:
            model.set_shape_parameters(_changed(values, label, float(value)))
            if score() < best - LOST:
                end = between(end, float(value))
                break
            end = float(value)
        ends.append(end)
    model.set_shape_parameters(values)
    return ends[0], ends[1]


def _changed(values: Mapping[str, float], label: str, value: float) -> dict[str, float]:
    """All numbers with another value of one."""
    changed = dict(values)
    prefix, found, _ = label.rpartition("lambda.")
    if found:
        own = [n for n in values if n.startswith(f"{prefix}lambda.") and n != label]
        others = 1 - values[label]
        for other in own:
            # Almost nothing is left for the others: their ratios are rounding.
            few = others < NOTHING
            changed[other] = (1 - value) / len(own) if few else values[other] * (1 - value) / others
    changed[label] = value
    return changed
