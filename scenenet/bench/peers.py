"""Alternative implementations that the benchmark compares with."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import torch
from torch import Tensor
from torch.nn import functional

from scenenet.dataset.voxels import VoxelGrid
from scenenet.pointcloud import PointCloud


def conv3d_summed(volume: Tensor, kernels: Tensor) -> Tensor:
    """torch's dense convolution of (B, D, H, W) with the sum of kernels (K, kz, ky, kx)."""
    return _same(volume, kernels.sum(0, keepdim=True))[:, 0]


def conv3d_three(volume: Tensor, kernels: Tensor) -> Tensor:
    """torch's dense convolution with each of the kernels, and the sum of the results."""
    return _same(volume, kernels).sum(dim=1)


def published_code(volume: Tensor, kernels: Tensor) -> Tensor:
    """As in the published code of the thesis: double precision, one convolution per kernel."""
    responses = [_same(volume.double(), kernel[None].double()) for kernel in kernels]
    return torch.stack(responses).sum(dim=0)[:, 0]


def fft_summed(volume: Tensor, kernels: Tensor) -> Tensor:
    """Convolution with the sum of the kernels through the Fourier transform."""
    kernel = kernels.sum(0)
    shape = tuple(n + k - 1 for n, k in zip(volume.shape[1:], kernel.shape, strict=True))
    spectrum = torch.fft.rfftn(volume, s=shape, dim=(1, 2, 3))
    # conv3d correlates, which is a convolution with the mirrored kernel.
    spectrum = spectrum * torch.fft.rfftn(kernel.flip(0, 1, 2), s=shape)
    full = torch.fft.irfftn(spectrum, s=shape, dim=(1, 2, 3))
    begins = [k - 1 - (k - 1) // 2 for k in kernel.shape]
    d, h, w = (slice(b, b + n) for b, n in zip(begins, volume.shape[1:], strict=True))
    return full[:, d, h, w]


def pandas_voxels(cloud: PointCloud, grid: VoxelGrid) -> tuple[np.ndarray, np.ndarray]:
    """Counts and labels of a crop, computed as in the published code of the thesis.

    The code computes counts and labels one after the other, each with its own voxel grid: it finds
    the voxel of each point along each axis, computes the centres of all voxels (as pyntcloud does),
    groups the points in pandas, and fills a dense grid group by group.

    Returns:
        (D, H, W) float64 counts, scaled to [0, 1], and labels.
    """
    counts, truth = np.zeros(grid.shape), np.zeros(grid.shape)
    groups = pd.DataFrame(_places(cloud.xyz, grid) | {"points": 1}).groupby(["z", "y", "x"])
    for place, row in groups.count().iterrows():
        counts[place] = row["points"]
    labelled = _places(cloud.xyz, grid) | {"tower": cloud.is_tower.astype(float)}
    for place, row in pd.DataFrame(labelled).groupby(["z", "y", "x"]).max().iterrows():
        truth[place] = row["tower"]
    low, high = counts.min(), counts.max()
    return (counts - low) / (high - low), truth


def _places(xyz: np.ndarray, grid: VoxelGrid) -> dict[str, np.ndarray]:
    """Position of each point along each axis. The centres of all voxels are computed as well,
    because the published code does so, and are not used."""
    nz, ny, nx = grid.shape
    borders = [
        np.linspace(low, low + n * grid.voxel_size, n + 1)
        for low, n in zip(grid.origin, (nx, ny, nz), strict=True)
    ]
    middles = [(b[1:] + b[:-1]) / 2 for b in borders]
    np.stack(np.meshgrid(*middles, indexing="ij"), axis=-1).reshape(-1, 3).astype(np.float32)
    return {
        name: np.clip(np.searchsorted(b, xyz[:, axis]) - 1, 0, len(b) - 2)
        for axis, (name, b) in enumerate(zip("xyz", borders, strict=True))
    }


def dense_error(
    volume: Tensor, kernel: Tensor, tower: np.ndarray, weights: tuple[float, float]
) -> Tensor:
    """The error of a training step with dense operations: conv3d, tanh, ReLU, weighted squares."""
    prediction = torch.relu(torch.tanh(conv3d_summed(volume, kernel[None])))
    truth = torch.zeros_like(prediction)
    truth.view(-1)[torch.from_numpy(tower)] = 1
    weight = torch.where(truth > 0, weights[1], weights[0])
    return (weight * (prediction - truth).square()).mean()


def read_and_write(path: Path, out: Path, chunk_points: int) -> None:
    """Read a survey and write it again with laspy, in chunks: the least that any tool must do."""
    import laspy

    with laspy.open(path) as reader, laspy.open(out, mode="w", header=reader.header) as writer:
        for points in reader.chunk_iterator(chunk_points):
            writer.write_points(points)


def _same(volume: Tensor, kernels: Tensor) -> Tensor:
    with warnings.catch_warnings():
        # For even sizes torch warns about a copy, whose time belongs to the measurement.
        warnings.filterwarnings("ignore", message="Using padding='same'")
        return functional.conv3d(volume[:, None], kernels[:, None], padding="same")
