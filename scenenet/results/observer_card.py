"""The card of an observer that comes with the package: data, use, limits and scores (Markdown)."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from scenenet.core.errors import InputError
from scenenet.core.files import atomic, read_json, sha256, write_text
from scenenet.evaluation.result import Scores
from scenenet.metrics.score_columns import score_text
from scenenet.results.folder import Results

TEXT = """\
# The observer `{name}`

| | |
|---|---|
| file | `{file}` |
| SHA-256 | `{digest}` |
| finds | {target} |
| architecture | SCENE-Net of two observers, {parameters} parameters, kernels in metres |
| trained on | {training} squares of the synthetic surveys {surveys} |
| tau chosen on | these and {validation} validation squares |
| tested on | {test} other squares of these surveys |

The workflow made it (rule `packaged_wires`). It is never edited.

## Use

To find the points of conductors in airborne LiDAR surveys with metric coordinates. With
`scenenet predict --line` spans, conductors and clearances follow from it. A model that was trained
on labelled surveys of your own region may be better: `scenenet train --target wire`.

## Limits

- It has seen synthetic surveys only: lines of poles and pylons from 14 to 50 m high, with single
  wires and bundles of two and of four.
- Jibs of cranes, fences and edges of roofs may count as wires. Insulators and jumpers mostly do
  not.
- A single thin wire that few pulses hit is found in part, or not at all.
- Bundles of four with many points on each wire are found in part near towers
  (docs/method/observers.md).
- Its probability ranks points of one survey. It is not the share of right answers.
- Look at every result before you act on it.

## Scores

On the test squares. The truth is what the generator placed. Scores on recordings are in
docs/method/observers.md.

| | precision of points | recall of points | iou of points | of voxels: precision | recall | iou |
|---|---|---|---|---|---|---|
{scores}

## Parameters

The lengths are fixed. The crops choose the weights of the first observer.

| parameter | value | unit | meaning |
|---|---|---|---|
{numbers}
"""


def write_observer_card(
    results: Results,
    name: str,
    split: str | Path,
    model: str | Path,
    out_model: str | Path,
    out_card: str | Path,
) -> None:
    """Copy the model of an observer, and write its card.

    Args:
        results: the result folder.
        name: of the observer.
        split: the parts of its squares (``scenenet.dataset.split``).
        model: its model file (``scenenet.models.model_file``).
        out_model, out_card: files to write.

    Raises:
        InputError: the observer was not evaluated.
    """
    import pandas as pd

    from scenenet.models.model_file import read_model

    found = results.observer(name)
    if found is None:
        raise InputError("it was not evaluated, so it has no card", file=model)
    squares = pd.read_csv(split)
    parts = squares["part"].value_counts().to_dict()
    trained, card = read_model(model)
    text = TEXT.format(
        name=name,
        file=Path(out_model).name,
        digest=sha256(model),
        target=card.target,
        parameters=trained.n_parameters(),
        surveys=", ".join(sorted(set(squares["survey"]))),
        training=parts.get("train", 0),
        validation=parts.get("validation", 0),
        test=parts.get("test", 0),
        scores="\n".join(_scores(found.evaluation.truth, found.evaluation)),
        numbers="\n".join(_numbers(read_json(model))),
    )
    write_text(out_card, text)
    with atomic(out_model) as partial:
        shutil.copyfile(model, partial)


def _scores(truth: Scores | None, labels: Scores) -> Iterable[str]:
    """A row of the table against the truth, where it is known, and one against the labels."""
    for against, scores in (("the truth", truth), ("the labels", labels)):
        if scores is not None:
            points, voxels = scores.points, scores.voxel
            values = [getattr(points, each, None) for each in ("precision", "recall", "iou")]
            values += [voxels.precision, voxels.recall, voxels.iou_tower]
            yield f"| against {against} | {' | '.join(map(score_text, values))} |"


def _numbers(facts: Mapping[str, Any], prefix: str = "") -> Iterable[str]:
    """A row for each number of the first observer, then of the other."""
    if "first" in facts:
        yield from _numbers(facts["first"], "first.")
    for geneo in facts["geneos"]:
        for parameter, known in geneo["parameters"].items():
            name = f"`{prefix}{geneo['name']}.{parameter}`"
            yield f"| {name} | {known['value']:.3g} | {known['unit']} | {known['meaning']} |"
    for name, weight in facts["mixing_weights"].items():
        meaning = f"weight of the {name.replace('_', ' ')}"
        yield f"| `{prefix}lambda.{name}` | {weight:.3g} | 1 | {meaning} |"
