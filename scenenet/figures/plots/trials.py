"""The answers of a kernel on a survey (``scenenet geneo try``)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from scenenet.figures.plots.style import new_figure, save

LONGEST_SIDE, SHORTEST_SIDE = 8.0, 2.5
"""Sides of the map, inches."""


def answer_map(xy: np.ndarray, responses: np.ndarray, places: np.ndarray, out: str | Path) -> str:
    """A survey from above, coloured by the response of a kernel, with the highest places.

    Args:
        xy: (N, 2) m.
        responses: (N,).
        places: (P, 2) m, numbered from 1.
        out: PNG to write.
    """
    low = xy.min(axis=0)
    extent = np.maximum(np.ptp(xy, axis=0), 1.0)
    wide, high = np.clip(LONGEST_SIDE * extent / extent.max(), SHORTEST_SIDE, None)
    figure, axes = new_figure(1, 1, width=wide + 1.5, height=high + 0.6)
    axis = axes[0, 0]
    largest = float(np.abs(responses).max()) or 1.0
    # The highest last, so that the ground around it does not hide it.
    order = np.argsort(responses, kind="stable")
    shown = axis.scatter(*(xy - low)[order].T, c=responses[order], s=2, lw=0, cmap="RdBu_r",
                         vmin=-largest, vmax=largest, rasterized=True)  # fmt: skip
    for number, place in enumerate(places - low, start=1):
        axis.annotate(str(number), place, xytext=(3, 3), textcoords="offset points", fontsize=8)
    axis.set(xlabel="x [m]", ylabel="y [m]")
    axis.set_aspect("equal")
    figure.colorbar(shown, ax=axis, shrink=0.7, label="response")
    save(figure, out)
    return (
        f"Map of {len(xy)} points, {extent[0]:.0f} by {extent[1]:.0f} m, coloured by the response "
        f"from {responses.min():.3g} to {responses.max():.3g}; the {len(places)} highest places "
        "have numbers."
    )
