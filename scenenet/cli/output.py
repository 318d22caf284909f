"""The output of the commands: JSON for programs, tables for people."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from scenenet.metrics.score_columns import SCORE_COLUMNS, score_text


def show(data: Any, as_json: bool, lines: Callable[[Any], list[str]]) -> None:
    """Print ``data`` as JSON, or as the ``lines`` for people."""
    print(json.dumps(data, indent=2) if as_json else "\n".join(lines(data)))


def training_lines(result: dict[str, Any]) -> list[str]:
    scores, crops = result["scores"], result["crops"]
    lines = [
        f"{result['model']}: the best of {len(result['seeds'])} seeds (seed {result['seed']}), "
        f"{crops['training']} crops to train on, {crops['validation']} to tune on",
        f"tau {result['tau']:.3f}, kernel {'x'.join(map(str, result['kernel_size']))}, "
        f"on the {result['tuned_on']} crops: P {score_text(scores['precision'])} "
        f"R {score_text(scores['recall'])} F0.5 {score_text(scores['f05'], 3)} "
        f"tower IoU {score_text(scores['iou_tower'], 3)}",
    ]
    return lines + [f"skipped: {s['sample']}: {s['reason']}" for s in result["skipped"]]


def score_lines(result: dict[str, Any]) -> list[str]:
    def row(name: str, scores: dict[str, float | None]) -> str:
        values = [scores[column.name] for column in SCORE_COLUMNS]
        cells = ["-" if value is None else f"{value:.3f}" for value in values]
        return f"{name:<24}" + "".join(f"{cell:>10}" for cell in cells)

    towers = result["towers"]
    error = towers["median_error_m"]
    return [
        f"{'':<24}" + "".join(f"{column.label:>10}" for column in SCORE_COLUMNS),
        row(result["model"], result["voxel"]),
        row("  occupied voxels only", result["voxel_occupied"]),
        row("  voxels at or above tau", result["voxel_observer"]),
        row("  whole towers", result["voxel_towers"]),
        row("predicting nothing", result["voxel_trivial"]),
        f"{result['voxel']['n_samples']} crops, tau {result['voxel']['tau']:.3f}",
        f"towers: {towers['n_predicted']} found, {towers['n_true']} true, "
        f"precision {score_text(towers['precision'])}, recall {score_text(towers['recall'])}"
        + ("" if error is None else f", median position error {error:.2f} m"),
    ]
