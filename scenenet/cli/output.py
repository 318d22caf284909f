"""The output of the commands: JSON for programs, tables for people."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from scenenet.metrics.score_columns import SCORE_COLUMNS, score_text
from scenenet.pointcloud.targets import TOWER, Target


def show(data: Any, as_json: bool, lines: Callable[[Any], list[str]]) -> None:
    """Print ``data`` as JSON, or as the ``lines`` for people."""
    text = json.dumps(data, indent=2) if as_json else "\n".join(lines(data))
    if text:  # no empty line where every input failed
        print(text)


def training_lines(result: dict[str, Any]) -> list[str]:
    scores, crops, n_seeds = result["scores"], result["crops"], len(result["seeds"])
    chosen = "of one seed" if n_seeds == 1 else f"the best of {n_seeds} seeds"
    lines = [
        f"{result['model']}: {chosen} (seed {result['seed']}), "
        f"{crops['training']} crops to train on, {crops['validation']} to tune on",
        f"tau {result['tau']:.3f}, kernel {'x'.join(map(str, result['kernel_size']))}, "
        f"on the {result['tuned_on']} crops: P {score_text(scores['precision'])} "
        f"R {score_text(scores['recall'])} F0.5 {score_text(scores['f05'], 3)} "
        f"{result['target']} IoU {score_text(scores['iou_tower'], 3)}",
    ]
    if (whole := result["whole_towers"]) is not None:
        lines.append(
            f"whole towers in these crops: P {score_text(whole['precision'])} "
            f"R {score_text(whole['recall'])} F0.5 {score_text(whole['f05'], 3)}; "
            "the seed was chosen by this F0.5"
        )
    lines += _number_lines(result["numbers"])
    return lines + [f"skipped: {s['sample']}: {s['reason']}" for s in result["skipped"]]


def _number_lines(numbers: list[dict[str, Any]]) -> list[str]:
    """The parameters that the crops determine, and the names of the others."""
    lines = []
    for n in numbers:
        if n["determined"]:
            unit = "" if n["unit"] == "1" else f" {n['unit']}"
            between = f"{n['low']:.3g} to {n['high']:.3g}"
            lines.append(f"{n['name']} {n['value']:.3g}{unit} ({between}, by {n['source']})")
    others = [n["name"] for n in numbers if not n["determined"]]
    if others:
        lines.append(f"not determined by these crops: {', '.join(others)}")
    return lines


def score_lines(result: dict[str, Any]) -> list[str]:
    """The scores against the truth, where it is known, and those against the labels."""
    truth, of_labels = result["truth"], result["labels_against_truth"]
    target = Target.parse(result.get("target", TOWER.text)).name
    if truth is None:
        return _scores(result, result["model"], "labelled", target)
    return [
        "against the truth",
        *_scores(truth, result["model"], "true", target),
        "the labels themselves: " + _points(of_labels, f"labelled {target}", "true", target),
        "",
        "against the labels",
        *_scores(result, result["model"], "labelled", target),
    ]


def _scores(result: dict[str, Any], model: str, kind: str, target: str) -> list[str]:
    labels = [f"{column.label.replace(TOWER.name, target):>9}" for column in SCORE_COLUMNS]

    def row(name: str, scores: dict[str, float | None]) -> str:
        values = [scores[column.name] for column in SCORE_COLUMNS]
        cells = ["-" if value is None else f"{value:.3f}" for value in values]
        return f"{name:<24}" + "".join(
            f"{cell:>{len(label) + 1}}" for cell, label in zip(cells, labels, strict=True)
        )

    voxels = [
        f"{'':<24}" + "".join(f"{label:>{len(label) + 1}}" for label in labels),
        row(model, result["voxel"]),
        row("  occupied voxels only", result["voxel_occupied"]),
        row("predicting nothing", result["voxel_trivial"]),
        f"{result['voxel']['n_samples']} crops, tau {result['voxel']['tau']:.3f}",
    ]
    towers = result["towers"]
    if towers is None:
        points = _points(result["points"], "at or above tau", kind, target)
        return [*voxels, f"points: {points}"]
    ways = {
        "  voxels at or above tau": result["voxel_observer"],
        "  whole towers": result["voxel_towers"],
    }
    # One of them is the way of the model itself, and would be a second row of the same scores.
    voxels[3:3] = [row(name, way) for name, way in ways.items() if way != result["voxel"]]
    errors = [
        f", median {what} error {towers[name]:.2f} m"
        for what, name in (
            ("position", "median_error_m"),
            ("height", "median_height_error_m"),
            ("base", "median_base_error_m"),
        )
        if towers[name] is not None
    ]
    lines = [
        f"towers: {towers['n_predicted']} found, {towers['n_true']} {kind}, "
        f"precision {score_text(towers['precision'])}, recall {score_text(towers['recall'])}"
        + "".join(errors),
        *voxels,
        "points: " + _points(result["points"], "with a tower id", kind, target),
    ]
    if kind == "labelled":
        lines.append(
            "labels cover what stands around a tower too, so the recall of its points is low even "
            "where every tower is found"
        )
    return lines


def _points(points: dict[str, Any], predicted: str, kind: str, target: str) -> str:
    return (
        f"{points['n_predicted']:,} {predicted}, {points['n_true']:,} {kind} {target} points, "
        f"precision {score_text(points['precision'])}, recall {score_text(points['recall'])}, "
        f"IoU {score_text(points['iou'])}"
    )
