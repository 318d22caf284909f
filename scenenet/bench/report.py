"""The result of the benchmark as text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any


def tables(result: dict[str, Any]) -> list[str]:
    """Lines of Markdown: a table for each part that was run."""
    machine = result["machine"]
    occupied = [crop["occupied_64"] / 64**3 for crop in result["crops"]]
    lines = [
        f"{machine['processor']}, {machine['threads']} threads, torch {machine['torch']}, "
        f"numba {machine['numba']}; medians of interleaved runs.",
        f"{len(occupied)} crops, {100 * min(occupied):.1f}-{100 * max(occupied):.1f} % of the "
        f"voxels occupied at 64^3; the convolution runs on the crop of median occupancy.",
        "",
        *_convolution(result["convolution"]),
    ]
    if "gradient" in result:
        lines += _gradient(result["gradient"])
    if "training_step" in result:
        lines += _work(result)
    if "thesis_training" in result:
        entry = result["thesis_training"]
        lines += [
            "",
            f"Training as in the thesis ({entry['crops']} crops, {entry['epochs']} epochs, 9x9x9, "
            f"64^3): {entry['seconds']:.0f} s, {entry['ms_per_step']:.1f} ms per step. "
            f"The thesis took {entry['thesis_minutes']:.0f} minutes on an RTX 3070.",
        ]
    return lines


def _convolution(section: dict[str, Any]) -> list[str]:
    rows = [
        [
            f"{resolution}^3",
            size,
            f"{entry['ours_ms']:.3f}",
            f"{entry['one_core_ms']:.3f}",
            f"{entry['conv3d_f32_ms']:.1f}",
            f"{entry['fft_ms']:.1f}",
            f"{entry['reference_ms']:.0f}",
            f"{entry['speedup_vs_conv3d']:.0f}",
            f"{entry['speedup_vs_reference']:.0f}",
            f"{entry['speedup_of_cores']:.2f}",
        ]
        for resolution, sizes in section.items()
        for size, entry in sizes.items()
    ]
    head = ["grid", "kernel", "ours ms", "on one core", "conv3d", "FFT", "reference ms"]
    head += ["faster than conv3d", "faster than reference", "speed-up by more cores"]
    return _table(head, rows)


def _gradient(section: dict[str, Any]) -> list[str]:
    rows = [
        [
            f"{resolution}^3",
            size,
            f"{entry['ours_ms']:.3f}",
            f"{entry['ratio_to_forward']:.2f}",
            f"{entry['conv3d_f32_ms']:.1f}",
            f"{entry['speedup_vs_conv3d']:.0f}",
        ]
        for resolution, sizes in section.items()
        for size, entry in sizes.items()
    ]
    head = ["grid", "kernel", "gradient ms", "relative to the forward pass", "conv3d"]
    head.append("faster than conv3d")
    return ["", *_table(head, rows)]


def _work(result: dict[str, Any]) -> list[str]:
    step, survey = result["training_step"], result["survey"]
    rows = [
        [
            f"training step, {step['batch_size']} crops, {step['kernel_size']}, 64^3",
            f"{step['ours_ms']:.2f} ms",
            f"conv3d {step['conv3d_ms']:.0f} ms",
            f"{step['speedup']:.0f}",
        ]
    ]
    for resolution, entry in result["voxelisation"].items():
        rows.append(
            [
                f"voxelisation, {entry['points']:,} points, {resolution}^3",
                f"{entry['ours_ms']:.2f} ms",
                f"pandas {entry['pandas_ms']:.0f} ms",
                f"{entry['speedup']:.0f}",
            ]
        )
    for name, entry in result["orbits"].items():
        rows.append(
            [
                f"{entry['kernels']} directions of {name} at the voxels of a crop",
                f"{entry['ours_ms']:.0f} ms",
                f"one after the other {entry['each_ms']:.0f} ms, by position "
                f"{entry['by_position_ms']:.0f} ms, one {entry['one_ms']:.0f} ms",
                f"{entry['each_ms'] / entry['ours_ms']:.0f}",
            ]
        )
    rows.append(
        [
            f"survey, {survey['points']:,} points, file to file",
            f"{survey['ours_points_per_s'] / 1e6:.2f} M points/s",
            f"laspy alone {survey['laspy_points_per_s'] / 1e6:.2f} M points/s",
            f"{1 / survey['times_laspy']:.2f}",
        ]
    )
    return ["", *_table(["work", "ours", "peer", "speed relative to the peer"], rows)]


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    widths = [max(len(row[i]) for row in [head, *rows]) for i in range(len(head))]

    def line(cells: Sequence[str]) -> str:
        return "| " + " | ".join(c.ljust(w) for c, w in zip(cells, widths, strict=True)) + " |"

    return [line(head), "|" + "|".join("-" * (w + 2) for w in widths) + "|", *map(line, rows)]
