"""Crops of several surveys, synthetic and recorded, at the same scale."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from scenenet.figures.plots.point_clouds import principal_axes
from scenenet.figures.plots.style import new_figure, save
from scenenet.pointcloud.class_schemes import LOOK_COLOURS


def compare_crops(crops: Mapping[str, tuple[np.ndarray, np.ndarray]], out: str | Path) -> str:
    """Every crop from the side, along its line, and from above; all panels have the same scale.

    Args:
        crops: title -> ((N, 3) m, (N,) keys of ``LOOK_COLOURS``).
        out: PNG to write.

    Returns:
        its alternative text.
    """
    turned = {
        title: (_turned(xyz, kinds == "conductor"), kinds) for title, (xyz, kinds) in crops.items()
    }
    half = max(float(np.abs(xyz[:, :2]).max()) for xyz, _ in turned.values()) + 1
    wide = max(float(np.abs(xyz[:, 1]).max()) for xyz, _ in turned.values()) + 1
    top = max(float(xyz[:, 2].max()) for xyz, _ in turned.values()) + 2
    column = 2.3
    scale = column / (2 * half)
    figure, axes = new_figure(
        2,
        len(crops),
        width=column * len(crops) + 0.9,
        height=scale * (top + 2 * wide) + 1.5,
        height_ratios=[top, 2 * wide],
    )
    for (title, (xyz, kinds)), (side, above) in zip(turned.items(), axes.T, strict=True):
        for kind, colour in LOOK_COLOURS.items():
            member = kinds == kind
            style = {"s": 0.6 if kind != "tower" else 1.4, "lw": 0, "c": colour, "rasterized": True}
            side.scatter(xyz[member, 0], xyz[member, 2], **style)
            above.scatter(xyz[member, 0], xyz[member, 1], **style)
        side.set_title(title, fontsize=9)
        side.set(xlim=(-half, half), ylim=(-2, top), aspect="equal")
        above.set(xlim=(-half, half), ylim=(-wide, wide), aspect="equal", xlabel="along [m]")
    axes[0, 0].set_ylabel("height [m]")
    axes[1, 0].set_ylabel("across [m]")
    for axis in axes[:, 1:].flat:
        axis.set_yticklabels([])
    dots = [axes[0, 0].plot([], [], "o", ms=5, c=colour, label=kind)[0]
            for kind, colour in LOOK_COLOURS.items()]  # fmt: skip
    figure.legend(handles=dots, loc="outside lower center", ncols=len(LOOK_COLOURS), frameon=False,
                  fontsize=9)  # fmt: skip
    save(figure, out)
    titles = ", ".join(title.replace("\n", " ") for title in crops)
    return (
        f"{len(crops)} crops at one scale, from the side and from above: {titles}. "
        f"The highest point is {top - 2:.0f} m above the lowest."
    )


def _turned(xyz: np.ndarray, conductor: np.ndarray) -> np.ndarray:
    """Points (N, 3) about the middle of the crop; the first axis runs along the points that are
    ``conductor`` (N,), where there are enough, else where the crop spreads most."""
    line = conductor if conductor.sum() > 30 else np.ones(len(xyz), bool)
    middle = (xyz.min(axis=0) + xyz.max(axis=0)) / 2
    across = (xyz[:, :2] - middle[:2]) @ principal_axes(xyz[line, :2])
    return np.column_stack((across, xyz[:, 2] - xyz[:, 2].min()))
