"""Samples of the TS40K dataset: crops stored as numpy arrays or torch dictionaries.

- ``.npy``: (N, 4) numbers, x, y, z and the class code.
- ``.pt``: a dictionary with ``input_pcd`` (N, 3) and ``semantic_labels`` (N,), (N, 1) or (1, N);
  further entries (``type``, ``obj_boxes``) are not used.

The ``.npy`` crops have ``edp`` codes. The tools of the dataset write ``.pt`` samples with six
merged classes (class scheme ``ts40k``), unless this is turned off.

Neither is loaded with pickle, so that a downloaded sample cannot run code.
"""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from scenenet.core.errors import InputError

POINTS_KEY, LABELS_KEY = "input_pcd", "semantic_labels"
FIX_PT = (
    "Save a dictionary with input_pcd (N, 3) and semantic_labels (N,), both torch tensors, with "
    "torch.save"
)
FIX_NPY = "Save x, y, z and the class code of each point as an (N, 4) float64 array with numpy.save"


def read_sample(path: str | Path, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates (N, 3) float64 and class codes (N,) uint8 of a sample.

    Args:
        path: the file.
        kind: ``npy`` or ``pt``.

    Raises:
        InputError: the file is damaged, needs pickle, or does not contain points.
    """
    path = Path(path)
    xyz, codes = _from_npy(path) if kind == "npy" else _from_pt(path)
    bad = np.flatnonzero(~np.isfinite(xyz).all(axis=1))
    if len(bad):
        raise InputError(
            f"{len(bad)} points have a coordinate that is not a number; the first is "
            f"{xyz[bad[0]].tolist()}",
            file=path,
            place=f"row {bad[0]}",
            remedy="Remove these points from the file",
        )
    with np.errstate(invalid="ignore"):
        wrong = np.flatnonzero(~((codes >= 0) & (codes <= 255) & (codes == np.floor(codes))))
    if len(wrong):
        raise InputError(
            f"{len(wrong)} class codes are not whole numbers from 0 to 255; the first is "
            f"{codes[wrong[0]]}",
            file=path,
            place=f"row {wrong[0]}",
            remedy="Put the class code in the last column (.npy) or in semantic_labels (.pt)",
        )
    return np.ascontiguousarray(xyz, dtype=np.float64), codes.astype(np.uint8)


def _from_npy(path: Path) -> tuple[np.ndarray, np.ndarray]:
    try:
        # Mapped, so that a header with a wrong shape is detected from the size of the file.
        array = np.load(path, mmap_mode="r", allow_pickle=False)
    except Exception as error:  # a damaged header can make numpy raise anything
        text = _first_line(error)
        problem = f"the array cannot be read ({text})"
        if "Object arrays" in text or "Python objects" in text:
            problem = "the array has Python objects, which are not loaded because they can run code"
        elif "mmap length" in text or "greater than file size" in text:
            problem = f"the file is truncated: it is shorter than its array ({text})"
        raise InputError(problem, file=path, remedy=FIX_NPY) from error
    if array.dtype.kind not in "fiu":
        raise InputError(
            f"the array has the type {array.dtype}, not numbers", file=path, remedy=FIX_NPY
        )
    if array.ndim != 2 or array.shape[1] != 4:
        raise InputError(
            f"the array has the shape {array.shape}, not (N, 4)", file=path, remedy=FIX_NPY
        )
    return array[:, :3].astype(np.float64), np.array(array[:, 3])


def _from_pt(path: Path) -> tuple[np.ndarray, np.ndarray]:
    sample = _load_torch(path)
    import torch

    if not isinstance(sample, dict) or not {POINTS_KEY, LABELS_KEY} <= sample.keys():
        content = (
            f"a dictionary with {sorted(map(str, sample))}" if isinstance(sample, dict) else ""
        )
        raise InputError(
            f"the file has {content or f'a {type(sample).__name__}'}, not the dictionary of a "
            f"TS40K sample ({POINTS_KEY}, {LABELS_KEY})",
            file=path,
            remedy=FIX_PT,
        )
    points, labels = sample[POINTS_KEY], sample[LABELS_KEY]
    for key, value in ((POINTS_KEY, points), (LABELS_KEY, labels)):
        plain = isinstance(value, torch.Tensor) and value.layout == torch.strided
        if not plain or value.device.type != "cpu" or value.is_complex():
            raise InputError(
                f"{key} is a {type(value).__name__}, not a plain tensor of numbers",
                file=path,
                remedy=FIX_PT,
            )
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(
            f"{POINTS_KEY} has the shape {tuple(points.shape)}, not (N, 3)",
            file=path,
            remedy=FIX_PT,
        )
    # A tensor can repeat one number without storing it, so a file of kilobytes can claim gigabytes.
    for key, value in ((POINTS_KEY, points), (LABELS_KEY, labels)):
        stored = value.untyped_storage().nbytes() // value.element_size()
        if value.numel() > stored:
            raise InputError(
                f"{key} has {value.numel()} numbers, of which the file stores {stored}",
                file=path,
                remedy="Save a copy of the tensor: tensor.contiguous()",
            )
    n = len(points)
    if tuple(labels.shape) not in {(n,), (n, 1), (1, n)}:
        raise InputError(
            f"{LABELS_KEY} has the shape {tuple(labels.shape)}, not ({n},) as {POINTS_KEY}",
            file=path,
            remedy=FIX_PT,
        )
    xyz = points.detach().to("cpu", torch.float64).numpy()
    return xyz, labels.detach().to("cpu", torch.float64).reshape(-1).numpy()


def _load_torch(path: Path) -> Any:
    import pickle

    import torch

    try:
        with warnings.catch_warnings(), torch.serialization.safe_globals(_numpy_numbers()):
            warnings.simplefilter("ignore")
            return torch.load(path, map_location="cpu", weights_only=True)
    except pickle.UnpicklingError as error:
        raise InputError(
            "the file is damaged or has Python objects other than tensors and numbers"
            f"{_refused_object(error)}. Such objects are not loaded because they can run code",
            file=path,
            remedy=FIX_PT,
        ) from error
    except Exception as error:  # a damaged file can make torch raise anything
        raise InputError(
            f"the file is damaged, or torch did not write it ({_first_line(error)})",
            file=path,
            remedy=FIX_PT,
        ) from error


def _numpy_numbers() -> list[Any]:
    """Types that numpy numbers need; the boxes of a sample contain some. None can run code."""
    scalar = np.float64(0).__reduce__()[0]
    kinds = {type(np.dtype(code)) for code in "fdbhilqBHILQ?"}
    names = ["numpy.core.multiarray.scalar", "numpy._core.multiarray.scalar"]  # numpy 1 and 2
    return [*((scalar, name) for name in names), np.dtype, *kinds]


def _refused_object(error: Exception) -> str:
    """The object that torch names in its refusal, in brackets.

    The rest of its message is left out: it tells how to switch the protection off.
    """
    named = re.search(r"GLOBAL ([\w.]+)", str(error))
    return f" ({named.group(1)})" if named else ""


def _first_line(error: Exception) -> str:
    lines = str(error).strip().splitlines() or [type(error).__name__]
    return lines[0][:300]


SAMPLE_SUFFIXES = (".npy", ".pt")


def sample_files(path: str | Path) -> list[Path]:
    """The TS40K samples at ``path``: the file itself, or those in the folder, by name.

    Returns:
        an empty list if ``path`` is a LAS, LAZ or COPC file.

    Raises:
        InputError: ``path`` is a folder without samples.
    """
    path = Path(path)
    if path.is_dir():
        samples = sorted(f for f in path.iterdir() if f.suffix in SAMPLE_SUFFIXES)
        if not samples:
            raise InputError(
                "the folder has no TS40K sample",
                file=path,
                remedy="Give a folder of .npy or .pt samples, or give surveys one by one",
            )
        return samples
    return [path] if path.suffix in SAMPLE_SUFFIXES else []
