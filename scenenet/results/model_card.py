"""The card of the model that comes with the package: data, use, limits and scores (Markdown)."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from scenenet.core.errors import InputError
from scenenet.core.files import atomic, read_json, sha256, write_text
from scenenet.evaluation.result import PointScores, Scores, TowerScores
from scenenet.metrics.score_columns import score_text
from scenenet.results.folder import Results
from scenenet.results.seed_result import SeedResult

TEXT = """\
# The model `{name}`

| | |
|---|---|
| file | `{file}` |
| SHA-256 | `{digest}` |
| architecture | SCENE-Net, {parameters} parameters, kernels in metres |
| trained on | {training} crops of the synthetic surveys {surveys} |
| chosen | seed {seed} of {n_seeds}, by the whole towers of {validation} validation crops |
| tested on | {test} other crops of these surveys |

The workflow made it (rule `packaged_model`). It is never edited.

## Use

To find the towers of power lines in airborne LiDAR surveys with metric coordinates. Commands use
it where no `--model` is given. A model that was trained on labelled surveys of your own region may
be better: `scenenet train`.

## Limits

- It has seen synthetic surveys only: poles and pylons from 14 to 30 m high, with conductors.
- A tower without conductors is not found, nor one lower than 9 m. Below 12 points per m2 some
  towers are missed; `scenenet predict` then warns.
- Its probability ranks places of one survey. It is not the share of right answers.
- Look at every result before you act on it.

## Scores

On the test crops. The truth is what the generator placed; labels also contain the surroundings of
a tower, as annotators write them. Scores on recordings are in docs/method/accuracy.md.

| | {columns} |
|---|{rule}|
{scores}

## Parameters

| parameter | value | unit | meaning |
|---|---|---|---|
{numbers}
"""


def write_model_card(
    results: Results, model: str | Path, out_model: str | Path, out_card: str | Path
) -> None:
    """Copy the best seed of the model that predicts, and write its card.

    Args:
        results: the result folder.
        model: the model file of that seed (``scenenet.models.model_file``).
        out_model, out_card: files to write.

    Raises:
        InputError: the model was not evaluated, or is not a SCENE-Net in metres.
    """
    from scenenet.models.model_file import read_model

    name = results.predicting
    best = None if name is None else results.champion(name)
    facts = read_json(model)
    if best is None or facts.get("units") != "m":
        raise InputError(
            "no SCENE-Net in metres was evaluated, so there is no model to package",
            file=model,
            remedy="Set predict.model to a model of the protocol operational",
        )
    split = results.split()
    parts = {} if split is None else split["part"].value_counts().to_dict()
    scores = list(_scores(best))
    text = TEXT.format(
        name=name,
        file=Path(out_model).name,
        digest=sha256(model),
        parameters=read_model(model)[0].n_parameters(),
        surveys=", ".join(results.surveys),
        seed=best.seed,
        n_seeds=len(results.seeds),
        columns=" | ".join(column for column, _ in scores[0][1]),
        rule="|".join("---" for _ in scores[0][1]),
        scores="\n".join(_row([against, *(text for _, text in row)]) for against, row in scores),
        numbers="\n".join(map(_row, _numbers(facts))),
        training=parts.get("train", 0),
        validation=parts.get("validation", 0),
        test=parts.get("test", 0),
    )
    write_text(out_card, text)
    with atomic(out_model) as partial:
        shutil.copyfile(model, partial)


def _scores(best: SeedResult) -> Iterable[tuple[str, Sequence[tuple[str, str]]]]:
    """Against what -> (name, value) of each score."""
    if best.evaluation.truth is not None:
        yield "against the truth", _columns(best.evaluation.truth)
    yield "against the labels", _columns(best.evaluation)


def _columns(scores: Scores) -> list[tuple[str, str]]:
    towers: TowerScores = scores.towers
    points = asdict(scores.points) if scores.points else dict.fromkeys(PointScores.__annotations__)
    found = round((towers.recall or 0) * towers.n_true)
    counted = ("precision", "recall", "iou")
    return [
        ("towers found", f"{found} of {towers.n_true}"),
        ("false towers", str(towers.n_predicted - found)),
        *((f"{name} of points", score_text(points[name])) for name in counted),
        ("error of position, m", score_text(towers.median_error_m)),
        ("of height, m", score_text(towers.median_height_error_m)),
        ("of base, m", score_text(towers.median_base_error_m)),
    ]


def _numbers(facts: dict[str, Any]) -> Iterable[list[str]]:
    evidence = facts.get("evidence", {})

    def meaning(label: str, text: str) -> str:
        if label in evidence and not evidence[label]["determined"]:
            return f"nominally the {text}; not determined by the training crops"
        return text

    for geneo in facts["geneos"]:
        for parameter, known in geneo["parameters"].items():
            label = f"{geneo['name']}.{parameter}"
            text = meaning(label, known["meaning"])
            yield [f"`{label}`", f"{known['value']:.3g}", known["unit"], text]
    for name, weight in facts["mixing_weights"].items():
        label = f"lambda.{name}"
        text = meaning(label, f"weight of the {name.replace('_', ' ')}")
        yield [f"`{label}`", f"{weight:.3g}", "1", text]


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"
