"""The parts of the benchmark: each times this package against alternative implementations."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import torch
from pydantic import Field

from scenenet.bench import peers
from scenenet.bench.crops import crops_in, synthetic_crops
from scenenet.bench.orbits import orbits
from scenenet.bench.timing import medians
from scenenet.convolution.convolve import convolution_gradient, convolve
from scenenet.convolution.occupancy import Occupancy
from scenenet.core.progress import track
from scenenet.core.provenance import package_version
from scenenet.core.scratch import scratch_folder
from scenenet.core.settings import Settings
from scenenet.dataset.batches import batch
from scenenet.dataset.voxels import VoxelSample, VoxelSettings, voxelise
from scenenet.models.scenenet import SceneNet
from scenenet.models.settings import KernelSize, LossSettings
from scenenet.pointcloud import PointCloud
from scenenet.training.losses import VoxelWeights, fidelity, negativity
from scenenet.training.optimiser import Optimiser

SIZES: tuple[KernelSize, ...] = ((9, 9, 9), (9, 5, 5), (12, 5, 5))
"""The thesis' kernel size in training and after tuning, and an even size that is often better."""
RESOLUTIONS = (64, 128)
BATCH = 8


class BenchSettings(Settings):
    """The parts of the benchmark that run, and on which crops."""

    crops: Path | None = Field(None, description="folder of samples; synthetic crops if null")
    codes: str = Field("edp", description="class scheme of the samples")
    quick: bool = Field(False, description="only the convolution, with few repetitions")
    thesis: bool = Field(False, description="also run the training of the thesis at its scale")


def bench(settings: BenchSettings) -> dict[str, Any]:
    """Run the benchmark.

    Returns:
        convolution, gradient, training_step, voxelisation, orbits, survey, crops and machine
        (``quick``: convolution, crops and machine), and thesis_training if ``settings.thesis``;
        plain numbers, times in ms.

    Raises:
        InputError: a crop cannot be read.
    """
    crops = (
        synthetic_crops(BATCH)
        if settings.crops is None
        else crops_in(settings.crops, settings.codes)
    )
    grids = {
        resolution: [
            voxelise(crop, VoxelSettings(resolution=resolution).grid(crop.xyz), f"{i}")
            for i, crop in enumerate(crops)
        ]
        for resolution in RESOLUTIONS
    }
    steps: dict[str, Callable[[], Any]] = {
        "convolution": lambda: convolution(grids, 5 if settings.quick else 25)
    }
    if not settings.quick:
        steps |= {
            "gradient": lambda: gradient(grids),
            "training_step": lambda: training_step(grids[64]),
            "voxelisation": lambda: voxelisation(crops),
            "orbits": lambda: orbits(crops),
            "survey": survey,
        }
    if settings.thesis:
        from scenenet.bench.thesis_training import thesis_training

        steps["thesis_training"] = thesis_training
    result = {name: step() for name, step in track(list(steps.items()), "bench")}
    result["crops"] = [
        {
            "points": len(crop),
            "occupied_64": len(grids[64][i].index),
            "occupied_128": len(grids[128][i].index),
        }
        for i, crop in enumerate(crops)
    ]
    return result | {"machine": machine()}


def convolution(grids: dict[int, list[VoxelSample]], repetitions: int) -> dict[str, Any]:
    """Convolution of a crop with a summed kernel, compared with torch's dense and Fourier ones.

    The crop has the median occupancy. ``conv3d_f32_ms`` is the faster of one summed and three
    kernels; the reference is the published code: double precision and three kernels.
    """
    return {
        str(resolution): {_named(size): _convolution(samples, size, repetitions) for size in SIZES}
        for resolution, samples in grids.items()
    }


def gradient(grids: dict[int, list[VoxelSample]]) -> dict[str, Any]:
    """The gradient with respect to the kernel, compared with the forward pass and with torch."""
    return {
        str(resolution): {_named(size): _gradient(samples, size) for size in SIZES}
        for resolution, samples in grids.items()
    }


@torch.no_grad()
def _convolution(samples: list[VoxelSample], size: KernelSize, repetitions: int) -> dict[str, Any]:
    occupancy, volume = _median_crop(samples)
    kernels = _kernels(size)
    kernel, threads = kernels.sum(0), numba.get_num_threads()

    def one_core() -> None:
        numba.set_num_threads(1)
        convolve(occupancy, kernel)
        numba.set_num_threads(threads)

    times = medians(
        {
            "ours": lambda: convolve(occupancy, kernel),
            "one_core": one_core,
            "summed": lambda: peers.conv3d_summed(volume, kernels),
            "three": lambda: peers.conv3d_three(volume, kernels),
            "fft": lambda: peers.fft_summed(volume, kernels),
        },
        repetitions,
    )
    # A run takes seconds, thousands of times as long as ours, so few runs are enough.
    reference = {"reference": lambda: peers.published_code(volume, kernels)}
    slow = medians(reference, 3, most_seconds=0.5 if repetitions < 10 else 20.0)["reference"]
    conv3d = min(times["summed"], times["three"])
    dense = peers.conv3d_summed(volume, kernels)
    difference = (convolve(occupancy, kernel) - dense).abs().max() / dense.abs().max()
    return {
        "ours_ms": times["ours"],
        "conv3d_f32_ms": conv3d,
        "fft_ms": times["fft"],
        "reference_ms": slow,
        "speedup_vs_conv3d": conv3d / times["ours"],
        "speedup_vs_reference": slow / times["ours"],
        "one_core_ms": times["one_core"],
        "speedup_of_cores": times["one_core"] / times["ours"],
        "difference": float(difference),
    }


def _gradient(samples: list[VoxelSample], size: KernelSize) -> dict[str, Any]:
    occupancy, volume = _median_crop(samples)
    upstream = torch.randn(volume.shape, generator=torch.Generator().manual_seed(0))
    weight = _kernels(size)[:1].requires_grad_()
    output = peers.conv3d_summed(volume, weight)
    kernel = weight.detach()[0]
    times = medians(
        {
            "ours": lambda: convolution_gradient(occupancy, upstream, size),
            "forward": lambda: convolve(occupancy, kernel),
            "conv3d": lambda: torch.autograd.grad(output, weight, upstream, retain_graph=True),
        },
        15,
    )
    return {
        "ours_ms": times["ours"],
        "forward_ms": times["forward"],
        "ratio_to_forward": times["ours"] / times["forward"],
        "conv3d_f32_ms": times["conv3d"],
        "speedup_vs_conv3d": times["conv3d"] / times["ours"],
    }


def training_step(samples: list[VoxelSample]) -> dict[str, Any]:
    """A training step of SCENE-Net: kernels, convolution, loss, backward pass and optimiser; with
    the sparse and with the dense convolution."""
    chosen = [samples[i % len(samples)] for i in range(BATCH)]
    size = (9, 9, 9)
    model = SceneNet(kernel_size=size, generator=torch.Generator().manual_seed(0))
    optimiser = Optimiser("rmsprop", model.parameters())
    n_tower = sum(len(s.labelled_index()) for s in chosen)
    weights = VoxelWeights.of_counts(n_tower, BATCH * 64**3, alpha=5.0, epsilon=0.1)
    occupancy, towers = batch(chosen, "presence")
    volume = occupancy.dense()

    def step(error: Callable[[], torch.Tensor]) -> None:
        optimiser.zero_grad()
        (error() + negativity(model, LossSettings())).backward()
        optimiser.step(1e-4)

    def ours() -> torch.Tensor:
        return fidelity(model, *batch(chosen, "presence"), weights)

    def dense() -> torch.Tensor:
        kernel, _ = model.observer()
        return peers.dense_error(volume, kernel, towers, (weights.empty, weights.tower))

    times = medians({"ours": lambda: step(ours), "conv3d": lambda: step(dense)}, 15)
    return {
        "batch_size": BATCH,
        "resolution": 64,
        "kernel_size": _named(size),
        "ours_ms": times["ours"],
        "conv3d_ms": times["conv3d"],
        "speedup": times["conv3d"] / times["ours"],
    }


def voxelisation(crops: list[PointCloud]) -> dict[str, Any]:
    """Voxelisation of a crop into counts and labels, compared with a grouping in pandas."""
    crop = sorted(crops, key=len)[len(crops) // 2]
    return {str(resolution): _voxelisation(crop, resolution) for resolution in RESOLUTIONS}


def _voxelisation(crop: PointCloud, resolution: int) -> dict[str, Any]:
    settings = VoxelSettings(resolution=resolution)
    times = medians(
        {
            "ours": lambda: voxelise(crop, settings.grid(crop.xyz)),
            "pandas": lambda: peers.pandas_voxels(crop, settings.grid(crop.xyz)),
        },
        7,
    )
    return {
        "points": len(crop),
        "ours_ms": times["ours"],
        "pandas_ms": times["pandas"],
        "speedup": times["pandas"] / times["ours"],
    }


def survey() -> dict[str, Any]:
    """Prediction of a survey from file to file by the model of the package, compared with laspy
    reading and writing it."""
    from scenenet.detection.settings import DetectionSettings
    from scenenet.models.packaged import packaged_model
    from scenenet.prediction.result_files import PredictionFiles
    from scenenet.prediction.settings import PredictSettings
    from scenenet.prediction.writers import predict_to_files
    from scenenet.synthetic import SyntheticSettings, make_survey

    with scratch_folder() as scratch:
        folder = Path(scratch)
        source = folder / "line.laz"
        points = make_survey(SyntheticSettings(towers=30, seed=0), source)["points"]
        settings = PredictSettings()

        def ours() -> None:
            out = PredictionFiles.of(source, folder / "out")
            predict_to_files(source, packaged_model(), out, settings, DetectionSettings())

        def laspy_alone() -> None:
            peers.read_and_write(source, folder / "copy.laz", settings.chunk_points)

        times = medians({"ours": ours, "laspy": laspy_alone}, 3, most_seconds=60.0)
    return {
        "points": points,
        "ours_points_per_s": 1e3 * points / times["ours"],
        "laspy_points_per_s": 1e3 * points / times["laspy"],
        "times_laspy": times["ours"] / times["laspy"],
    }


def machine() -> dict[str, Any]:
    """The machine and the versions of the measurement."""
    return {
        "processor": _processor(),
        "cores": len(os.sched_getaffinity(0))
        if hasattr(os, "sched_getaffinity")
        else os.cpu_count(),
        "threads": numba.get_num_threads(),
        "torch_threads": torch.get_num_threads(),
        "python": platform.python_version(),
        "torch": torch.__version__,
        "numba": numba.__version__,
        "scenenet": package_version(),
        "time": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
    }


def _median_crop(samples: list[VoxelSample]) -> tuple[Occupancy, torch.Tensor]:
    """The crop of median occupancy, sparse and as a dense volume (1, D, H, W)."""
    middle = sorted(samples, key=lambda sample: len(sample.index))[len(samples) // 2]
    occupancy, _ = batch([middle], "presence")
    return occupancy, occupancy.dense()


def _kernels(size: KernelSize) -> torch.Tensor:
    """Three random kernels (3, kz, ky, kx)."""
    return torch.randn((3, *size), generator=torch.Generator().manual_seed(0))


def _named(size: KernelSize) -> str:
    return "x".join(map(str, size))


def _processor() -> str:
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.is_file():
        for line in cpuinfo.read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
