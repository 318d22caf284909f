"""True classes from a second file with the same points, as ``scenenet synth --truth`` writes.

Labels are what annotators wrote; the truth is what stands there. A score says which of the two it
was measured against.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from scenenet.core.errors import InputError
from scenenet.pointcloud.cloud import PointCloud

ROUNDING_M = 1e-6
"""Coordinates may differ by this much beyond the steps of the two files, from the sums of offset
and steps in float64."""

SAME_POINTS = "Give the file with the same points in the same order, as scenenet synth --truth does"


def check_same_number(truth: Path, n_true: int, labelled: Path, n_labelled: int) -> None:
    """Refuse a file of true classes with another number of points.

    Raises:
        InputError: the numbers differ.
    """
    if n_true != n_labelled:
        raise InputError(
            f"it has {n_true} points, but {labelled} has {n_labelled}",
            file=truth,
            remedy=SAME_POINTS,
        )


def with_true_classes(
    labelled: Path,
    chunks: Iterator[PointCloud],
    truth: Path,
    true_chunks: Iterator[PointCloud],
    tolerance: np.ndarray,
) -> Iterator[PointCloud]:
    """The chunks of ``labelled`` with the classes of ``truth`` as their truth.

    Args:
        true_chunks: as many, with the same numbers of points.
        tolerance: (3,) m, largest difference of x, y and z of the same point in the two files.

    Raises:
        InputError: a point lies elsewhere in ``truth``; the message names it.
    """
    start = 0
    for chunk, true in zip(chunks, true_chunks, strict=True):
        moved = np.abs(true.xyz - chunk.xyz) > tolerance
        if moved.any():
            row = int(np.argmax(moved.any(axis=1)))
            raise InputError(
                f"it lies at {_place(true.xyz[row])}, but in {labelled} at "
                f"{_place(chunk.xyz[row])}",
                file=truth,
                place=f"point {start + row + 1}",
                remedy=SAME_POINTS,
            )
        start += len(chunk)
        yield replace(chunk, truth=true.classification)


def _place(xyz: np.ndarray) -> str:
    return "({:.3f}, {:.3f}, {:.3f})".format(*xyz)
