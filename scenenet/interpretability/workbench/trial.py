"""The response of a kernel on a survey, by place and by class, and its equivariance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scenenet.convolution.occupancy import Occupancy
from scenenet.core.errors import in_file
from scenenet.dataset.voxels import VoxelGrid
from scenenet.interpretability.workbench.description import KernelFacts, ParameterDescription
from scenenet.interpretability.workbench.description import parameters_of as described
from scenenet.interpretability.workbench.moved_scenes import Equivariance, measured_equivariance
from scenenet.interpretability.workbench.one_kernel import OneKernel
from scenenet.interpretability.workbench.window import (
    WHOLE,
    WINDOW_M,
    Window,
    middle_of,
    points_in,
)
from scenenet.pointcloud import PointCloud, read, survey_in_metres
from scenenet.pointcloud.class_schemes import SCHEMES

PLACES = 10
"""Number of places that are listed."""
APART_M = 5.0
"""Planar distance of two places, m: that within which a found tower is a labelled one."""


@dataclass(frozen=True)
class ClassAnswer:
    """The response at the points of one class.

    Attributes:
        code, name: of the class; the name is empty without a class scheme.
        points: number of its points.
        mean: mean response.
        positive: share of its points with a positive response, in [0, 1].
        highest: the largest response.
    """

    code: int
    name: str
    points: int
    mean: float
    positive: float
    highest: float


@dataclass(frozen=True)
class Place:
    """A voxel with a high response.

    Attributes:
        x, y, z: centre of the voxel, m, in the coordinates of the survey.
        response: there.
        code, name: the most frequent class of its points.
    """

    x: float
    y: float
    z: float
    response: float
    code: int
    name: str


@dataclass(frozen=True)
class Trial:
    """The response of a kernel on a survey.

    Attributes:
        kernel, survey: names.
        voxel_size: m.
        points, voxels: numbers of points and of occupied voxels.
        window: the square of the survey that was read; None for all of it.
        parameters: with the values that were tried.
        facts: of the sampled kernel.
        equivariance: measured on a generated scene, which is the same for every kernel.
        classes: the response by class, the highest mean first.
        places: the highest responses, ``APART_M`` from each other.
        xyz, codes, responses: (N, 3) m, (N,) uint8 and (N,) float32, the points.
    """

    kernel: str
    survey: str
    voxel_size: float
    points: int
    voxels: int
    window: Window | None
    parameters: tuple[ParameterDescription, ...]
    facts: KernelFacts
    equivariance: Equivariance
    classes: tuple[ClassAnswer, ...]
    places: tuple[Place, ...]
    xyz: np.ndarray
    codes: np.ndarray
    responses: np.ndarray


def try_kernel(
    chosen: OneKernel,
    survey: str | Path,
    codes: str | None = None,
    window: Window | None = None,
    edge: float = WINDOW_M,
) -> Trial:
    """Convolve a survey, or a square of it, with a kernel; the points of the square are in memory.

    Args:
        codes: class scheme of the labels, for the names of the classes; None if it is not known.
        window: the square; None for the whole survey, or, if it has more than ``WHOLE`` points, for
            one about the point in the middle of the file.
        edge: m, of this square.

    Raises:
        InputError: the survey cannot be used, has no points in the square, or is too large for the
            voxels.
    """
    n_points = survey_in_metres(survey).n_points
    if window is None and n_points > WHOLE:
        window = Window(*middle_of(survey, n_points), edge)
    cloud = read(survey, codes) if window is None else points_in(survey, window, codes)
    with in_file(survey):
        grid = VoxelGrid.on_map(cloud.xyz, chosen.voxel_size)
    at = grid.voxel_of(cloud.xyz)
    index, rows = np.unique(at, return_inverse=True)
    answers = chosen.answers(Occupancy.of_grids([index], None, grid.shape))
    names = SCHEMES[codes].class_name if codes else None
    titles = {
        int(code): names(int(code)) if names else "" for code in np.unique(cloud.classification)
    }
    return Trial(
        kernel=chosen.name,
        survey=str(survey),
        voxel_size=chosen.voxel_size,
        points=len(cloud),
        voxels=len(index),
        window=window,
        parameters=described(chosen),
        facts=KernelFacts.of(chosen.orbit, chosen.voxel_size),
        equivariance=measured_equivariance(chosen.answers, chosen.voxel_size),
        classes=_by_class(answers[rows], cloud.classification, titles),
        places=_places(answers, grid.centres(index), rows, cloud, titles),
        xyz=cloud.xyz,
        codes=cloud.classification,
        responses=answers[rows],
    )


def _by_class(
    answers: np.ndarray, codes: np.ndarray, titles: Mapping[int, str]
) -> tuple[ClassAnswer, ...]:
    """The answers (N,) at points with class codes (N,), by class."""
    found = []
    for code, title in titles.items():
        own = answers[codes == code].astype(float)
        positive = float((own > 0).mean())
        found.append(
            ClassAnswer(code, title, len(own), float(own.mean()), positive, float(own.max()))
        )
    return tuple(sorted(found, key=lambda one: -one.mean))


def _places(
    answers: np.ndarray,
    centres: np.ndarray,
    rows: np.ndarray,
    cloud: PointCloud,
    titles: Mapping[int, str],
) -> tuple[Place, ...]:
    """The highest positive answers (M,) at voxels with ``centres`` (M, 3).

    Args:
        rows: (N,) the voxel of each point.
    """
    left = answers > 0
    found: list[Place] = []
    for best in np.argsort(-answers, kind="stable"):
        if len(found) == PLACES or answers[best] <= 0:
            break
        if not left[best]:
            continue
        x, y, z = centres[best].tolist()
        left &= np.hypot(centres[:, 0] - x, centres[:, 1] - y) > APART_M
        code = int(np.bincount(cloud.classification[rows == best]).argmax())
        found.append(Place(x, y, z, float(answers[best]), code, titles[code]))
    return tuple(found)
