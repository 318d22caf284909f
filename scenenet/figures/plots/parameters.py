"""Kernels as slices and parameters as bars (thesis Figures 4.2 to 4.4, 5.5).

Every function writes one PNG and returns its alternative text.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scenenet.figures.plots.style import COLOURS, new_figure, readable, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.image import AxesImage

KERNEL_WIDTH = 2.6
"""Width of a column of slices, inches."""

UNITS = {"m": "length [m]", "m^2": "squared length [m²]", "1": "number without unit"}
"""Unit -> label of its axis."""


def kernels(
    weights: Mapping[str, np.ndarray],
    out: str | Path,
    starts: Mapping[str, np.ndarray] | None = None,
    metres: float | None = None,
) -> str:
    """Slices through the middle of each kernel (thesis Figures 4.2 to 4.4).

    Args:
        weights: name -> (kz, ky, kx). One row shows z against x, the one below y against x.
        out: PNG to write.
        starts: the kernels before training, in two rows above the others, with the same colours.
        metres: size of a voxel where the kernels are in metres; the axes are in voxels if None.
    """
    stages = (
        {"trained": weights} if starts is None else {"at the start": starts, "trained": weights}
    )
    views = [(stage, view) for stage in stages for view in ("side", "top")]
    deep, broad, wide = np.max([kernel.shape for kernel in weights.values()], axis=0)
    tall = {"side": float(deep / wide), "top": float(broad / wide)}
    heights = [min(tall[view], 2.5) for _, view in views]
    figure, axes = new_figure(
        len(views),
        len(weights),
        width=KERNEL_WIDTH * len(weights) + 0.4,
        height=(KERNEL_WIDTH - 0.7) * sum(heights) + 0.5 * len(views) + 0.9,
        height_ratios=heights,
    )
    for column, name in enumerate(weights):
        shown = [(stages[stage][name], view) for stage, view in views]
        image = _kernel_column(axes[:, column], shown, metres)
        axes[0, column].set_title(readable(name))
        figure.colorbar(image, ax=axes[:, column], location="bottom", shrink=0.85, pad=0.02,
                        label="weight")  # fmt: skip
    # The axes of a single kernel say enough.
    rows = [] if len(weights) == len(stages) == 1 else zip(axes[:, 0], views, strict=True)
    for axis, (stage, view) in rows:
        axis.annotate(f"{stage}, {'from the side' if view == 'side' else 'from above'}",
                      (-0.42, 0.5), xycoords="axes fraction", rotation=90, va="center",
                      ha="center", fontsize=9, fontweight="bold")  # fmt: skip
    save(figure, out)
    extent = "; ".join(
        f"{name} {stage} from {kernels[name].min():.3g} to {kernels[name].max():.3g}"
        for name in weights
        for stage, kernels in stages.items()
    )
    return f"Middle slices of the kernels, side view above and top view below. Weights: {extent}."


def _kernel_column(
    axes: np.ndarray, shown: Sequence[tuple[np.ndarray, str]], metres: float | None
) -> AxesImage:
    """Draw the slices of one kernel below each other.

    Args:
        axes: one per slice.
        shown: kernel (kz, ky, kx) and view (``side`` or ``top``) of each slice.
        metres: as in ``kernels``.

    Returns:
        one of the images, for the scale that all of them share.
    """
    # Each kernel has its own scale, or a kernel of small weights would not be visible.
    limit = max(float(np.abs(kernel).max()) for kernel, _ in shown) or 1.0
    unit = "voxel" if metres is None else "m"
    for axis, (kernel, view) in zip(axes, shown, strict=True):
        kz, ky, _ = kernel.shape
        middle = kernel[:, (ky - 1) // 2, :] if view == "side" else kernel[(kz - 1) // 2]
        image = axis.imshow(
            middle,
            cmap="RdBu_r",
            vmin=-limit,
            vmax=limit,
            origin="lower",
            extent=_extent(middle.shape, metres or 1.0),
        )
        axis.grid(False)
        axis.set_xlabel(f"x [{unit}]")
        axis.set_ylabel(f"{'z' if view == 'side' else 'y'} [{unit}]")
    return image


def parameters(
    values: Mapping[str, Sequence[float]],
    out: str | Path,
    units: Mapping[str, str] | None = None,
    starts: Mapping[str, float] | None = None,
    published: Mapping[str, float] | None = None,
) -> str:
    """The learned parameters with their spread over seeds (thesis Figure 5.5).

    Args:
        values: parameter, such as ``cylinder.r`` -> one value per seed.
        out: PNG to write. Mixing weights (``lambda.``) have a panel of their own, and so has each
            unit.
        units: parameter -> ``m``, ``m^2`` or ``1``; ``1`` for those that are not named.
        starts: parameter -> its mean before training, drawn as a hollow circle.
        published: parameter -> the thesis' value, drawn as a diamond.
    """
    starts, published, units = starts or {}, published or {}, units or {}
    panels: dict[str, list[str]] = {}
    for name in values:
        label = "mixing weight" if name.startswith("lambda.") else UNITS[units.get(name, "1")]
        panels.setdefault(label, []).append(name)
    order = sorted(panels, key=[*UNITS.values(), "mixing weight"].index)
    ratios = [len(panels[label]) for label in order]
    figure, axes = new_figure(
        len(order), 1, width=7.2, height=0.42 * sum(ratios) + 0.75 * len(order) + 0.6,
        height_ratios=ratios,
    )  # fmt: skip
    for axis, label, colour in zip(axes[:, 0], order, COLOURS, strict=False):
        names = panels[label]
        _bars(axis, {name: values[name] for name in names}, colour)
        for marker, marks in (("o", starts), ("D", published)):
            known = [(marks[name], place) for place, name in enumerate(names) if name in marks]
            if known:
                axis.plot(*np.array(known).T, marker, mfc="none", mec="#333", ms=8, ls="none")
        axis.set_yticks(range(len(names)), [readable(name) for name in names])
        axis.axvline(0, color="#444", lw=0.8)
        axis.invert_yaxis()
        axis.set_xlabel(label)
    save(figure, out)
    means = ", ".join(
        f"{name} {np.mean(v):.3g}" + (f" (initial {starts[name]:.3g})" if name in starts else "")
        for name, v in values.items()
    )
    return f"Bars of the mean learned parameters with a dot for each seed: {means}."


def _bars(axis: Axes, values: Mapping[str, Sequence[float]], colour: str) -> None:
    places = np.arange(len(values))
    means = [np.mean(v) for v in values.values()]
    spread = [np.std(v, ddof=1) if len(v) > 1 else 0 for v in values.values()]
    axis.barh(places, means, xerr=spread, color=colour, alpha=0.45, capsize=3)
    for place, of_seeds in zip(places, values.values(), strict=True):
        axis.plot(of_seeds, np.full(len(of_seeds), place), "o", color=colour, ms=3.5)


def _extent(shape: tuple[int, ...], step: float) -> tuple[float, float, float, float]:
    """Borders (left, right, bottom, top) of a slice around the element that the kernel is for."""
    rows, columns = shape
    left, bottom = (-((n - 1) // 2) - 0.5 for n in (columns, rows))
    return step * left, step * (left + columns), step * bottom, step * (bottom + rows)
