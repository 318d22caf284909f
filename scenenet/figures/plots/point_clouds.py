"""Points and voxels: crops, clusters, grids, whole surveys.

As in ``charts``, every function writes one PNG and returns its alternative text.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from scenenet.figures.plots.style import COLOURS, TOWER_COLOUR, new_figure, save
from scenenet.pointcloud.class_schemes import ROLE_COLOURS

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class View:
    """How one panel of a point cloud is coloured.

    Attributes:
        title: above the panel.
        values: (N,) names of ``ROLE_COLOURS``, or (N,) float probabilities in [0, 1].
        kind: which of the two.
        label: what the numbers are, beside their scale.
    """

    title: str
    values: np.ndarray
    kind: Literal["class", "probability"]
    label: str = "probability"


def side_views(xyz: np.ndarray, views: Sequence[View], out: str | Path) -> str:
    """One point cloud seen from the side, once per way of colouring it (thesis Figure 5.8).

    Args:
        xyz: (N, 3) m.
        views: the panels, left to right.
        out: PNG to write. The horizontal axis is the planar direction in which the points spread
            most, which for a crop of a line is mostly along it.
    """
    along, height = _side(xyz)
    panel_height = 4.2
    stretch = float(np.ptp(along)) / max(1.0, float(np.ptp(height)))
    panel_width = min(5.0, max(2.4, panel_height * stretch))
    figure, axes = new_figure(
        1, len(views), width=panel_width * len(views) + 1.6, height=panel_height + 1, sharey=True
    )
    points, label = None, ""
    for axis, view in zip(axes[0], views, strict=True):
        if view.kind == "class":
            _scatter_classes(axis, along, height, view.values)
        else:
            # The likeliest last, so that the ground does not hide them.
            order = np.argsort(view.values, kind="stable")
            points = axis.scatter(along[order], height[order], c=view.values[order], s=3, lw=0,
                                  cmap="viridis", vmin=0, vmax=1, rasterized=True)  # fmt: skip
            label = view.label
        axis.set(title=view.title, xlabel="along [m]")
        axis.set_aspect("equal")
    if points is not None:
        figure.colorbar(points, ax=axes[0, -1], shrink=0.7, label=label)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(ROLE_COLOURS),
                  frameon=False, markerscale=4, fontsize=9)  # fmt: skip
    axes[0, 0].set_ylabel("height [m]")
    save(figure, out)
    shown = ", ".join(view.title for view in views)
    return f"Side view of {len(xyz)} points, {np.ptp(height):.0f} m high, coloured by: {shown}."


def clusters(xy: np.ndarray, labels: np.ndarray, out: str | Path) -> str:
    """Points labelled tower from above, coloured by cluster (thesis Figure 5.2).

    Args:
        xy: (N, 2) m.
        labels: (N,) cluster of each point, -1 for noise.
        out: PNG to write. The line is turned to lie flat and the axes are not to one scale: a line
            is a hundred times as long as it is wide.
    """
    figure, axes = new_figure(1, 1, width=9.5, height=2.8)
    axis = axes[0, 0]
    noise = labels < 0
    found = np.unique(labels[~noise])
    if len(xy) > 1:
        local = (xy - xy.mean(axis=0)) @ principal_axes(xy)
        local[:, 0] -= local[:, 0].min()
        axis.scatter(*local[noise].T, s=4, c="#8A929B", marker="x", lw=0.6, rasterized=True)
        members = [local[labels == label] for label in found]
        members.sort(key=lambda member: member[:, 0].mean())
        for number, member in enumerate(members, start=1):
            colour = COLOURS[number % len(COLOURS)]
            axis.scatter(*member.T, s=5, color=colour, lw=0, rasterized=True)
            top = (member[:, 0].mean(), member[:, 1].max())
            axis.annotate(str(number), top, xytext=(0, 4), textcoords="offset points",
                          ha="center", fontsize=8)  # fmt: skip
    axis.margins(y=0.25)
    axis.set(xlabel="along the line [m]", ylabel="across [m]")
    save(figure, out)
    return (
        f"Map of {len(xy)} points labelled tower in {len(found)} clusters; "
        f"{int(noise.sum())} points belong to none."
    )


def voxel_grids(grids: Mapping[str, tuple[np.ndarray, np.ndarray]], out: str | Path) -> str:
    """Occupied voxels of one crop at several resolutions (thesis Figure 5.4).

    Args:
        grids: title -> ((M, 3) integer z, y, x of the occupied voxels, (M,) names of
            ``ROLE_COLOURS``).
        out: PNG to write.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(3.4 * len(grids), 4.6), layout="constrained")
    for place, (title, (zyx, names)) in enumerate(grids.items(), start=1):
        axis = figure.add_subplot(1, len(grids), place, projection="3d")
        z, y, x = zyx.T
        longest = max(1, int(np.ptp(zyx, axis=0).max()) + 1)
        size = (190 / longest) ** 2
        for name in reversed(list(ROLE_COLOURS)):
            member = names == name
            # One by one, so that what stands in front of a tower does not hide it.
            axis.scatter(x[member], y[member], z[member], c=ROLE_COLOURS[name], s=size, marker="s",
                         lw=0, alpha=1 if name in ("tower", "conductor") else 0.6)  # fmt: skip
        axis.set_title(title, y=0.98, fontsize=11)
        for side in (axis.xaxis, axis.yaxis, axis.zaxis):
            side.set_ticklabels([])
        axis.set_box_aspect([max(1, np.ptp(values)) for values in (x, y, z)], zoom=1.05)
        axis.view_init(elev=18, azim=-60)
    shown = {name for _, names in grids.values() for name in names}
    handles = [
        figure.axes[0].plot([], [], [], "s", c=colour, ms=7, label=name)[0]
        for name, colour in ROLE_COLOURS.items()
        if name in shown
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), frameon=False,
                  fontsize=9)  # fmt: skip
    save(figure, out)
    counts = "; ".join(
        f"{title}: {len(zyx)} occupied, {int((names == 'tower').sum())} tower"
        for title, (zyx, names) in grids.items()
    )
    return f"Occupied voxels of a crop in perspective, coloured by class. {counts}."


def survey_overview(
    xyz: np.ndarray, probability: np.ndarray, towers: np.ndarray, out: str | Path
) -> str:
    """A classified survey along its line, from above and from the side, towers marked.

    Args:
        xyz: (N, 3) m, thinned for drawing.
        probability: (N,) tower probability in [0, 1].
        towers: (T, 3) x, y and base elevation of the detected towers, m.
        out: PNG to write.
    """
    centre = xyz[:, :2].mean(axis=0)
    axes_of_line = principal_axes(xyz[:, :2])
    along, across = ((xyz[:, :2] - centre) @ axes_of_line).T
    start = along.min()
    figure, axes = new_figure(2, 1, width=9.5, height=5, sharex=True)
    order = np.argsort(probability, kind="stable")
    style = {"c": probability[order], "s": 1.2, "lw": 0, "cmap": "viridis", "vmin": 0, "vmax": 1}
    top, side = axes[:, 0]
    top.scatter((along - start)[order], across[order], rasterized=True, **style)
    points = side.scatter((along - start)[order], xyz[order, 2], rasterized=True, **style)
    if len(towers):
        at = (towers[:, :2] - centre) @ axes_of_line
        at[:, 0] -= start
        top.plot(at[:, 0], at[:, 1], "o", mfc="none", mec=TOWER_COLOUR, ms=11, mew=1.6)
        for number, (x, z) in enumerate(zip(at[:, 0], towers[:, 2], strict=True), start=1):
            side.axvline(x, color=TOWER_COLOUR, lw=0.7, alpha=0.6)
            side.annotate(str(number), (x, z), xytext=(3, -11), textcoords="offset points",
                          color=TOWER_COLOUR, fontsize=9)  # fmt: skip
    top.set(ylabel="across the line [m]")
    side.set(xlabel="along the line [m]", ylabel="elevation [m]")
    figure.colorbar(points, ax=axes, label="tower probability", shrink=0.7)
    save(figure, out)
    return (
        f"The survey from above and from the side over {np.ptp(along):.0f} m, coloured by tower "
        f"probability; {len(towers)} detected towers are marked."
    )


def labelled_survey(xyz: np.ndarray, names: np.ndarray, out: str | Path) -> str:
    """A labelled survey along its line, from above and from the side (thesis Figure 5.1).

    Args:
        xyz: (N, 3) m, thinned for drawing.
        names: (N,) of ``ROLE_COLOURS``.
        out: PNG to write.
    """
    along, across = ((xyz[:, :2] - xyz[:, :2].mean(axis=0)) @ principal_axes(xyz[:, :2])).T
    along -= along.min()
    figure, axes = new_figure(2, 1, width=9.5, height=5, sharex=True)
    top, side = axes[:, 0]
    _scatter_classes(top, along, across, names)
    _scatter_classes(side, along, xyz[:, 2], names)
    top.set(ylabel="across the line [m]")
    side.set(xlabel="along the line [m]", ylabel="elevation [m]")
    handles, labels = side.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(ROLE_COLOURS),
                  frameon=False, markerscale=4, fontsize=9)  # fmt: skip
    save(figure, out)
    shares = ", ".join(
        f"{name} {100 * (names == name).mean():.1f} %" for name in ROLE_COLOURS
        if (names == name).any()
    )  # fmt: skip
    return f"The survey from above and from the side over {np.ptp(along):.0f} m. Drawn: {shares}."


def principal_axes(xy: np.ndarray) -> np.ndarray:
    """(2, 2) columns: the direction of greatest spread and the one across it."""
    _, axes = np.linalg.eigh(np.cov((xy - xy.mean(axis=0)).T))
    along = axes[:, 1] * (1 if axes[0, 1] >= 0 else -1)
    return np.stack([along, [-along[1], along[0]]], axis=1)


def _side(xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    along = (xyz[:, :2] - xyz[:, :2].mean(axis=0)) @ principal_axes(xyz[:, :2])[:, 0]
    return along - along.min(), xyz[:, 2] - xyz[:, 2].min()


def _scatter_classes(axis: Axes, along: np.ndarray, height: np.ndarray, names: np.ndarray) -> None:
    for name in reversed(list(ROLE_COLOURS)):
        member = names == name
        if member.any():
            axis.scatter(along[member], height[member], s=2, lw=0, c=ROLE_COLOURS[name],
                         label=name, rasterized=True)  # fmt: skip
