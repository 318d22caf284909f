"""Small LAS files of every kind, generated for the tests."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import laspy
import numpy as np
import pyproj
import pytest

MakeLas = Callable[..., Path]


@pytest.fixture
def make_las(tmp_path: Path) -> MakeLas:
    """Writes a LAS or LAZ file with random values in every dimension."""

    def make(
        name: str = "survey.las",
        *,
        version: str = "1.4",
        point_format: int = 6,
        n: int = 100,
        extra: dict[str, str] | None = None,
        crs=None,
        scale: float = 0.01,
        seed: int = 0,
    ) -> Path:
        rng = np.random.default_rng(seed)
        header = laspy.LasHeader(version=version, point_format=point_format)
        header.scales, header.offsets = np.full(3, scale), np.array([544_000.0, 4_634_000.0, 100.0])
        for dimension, dtype in (extra or {}).items():
            header.add_extra_dim(laspy.ExtraBytesParams(dimension, dtype, description="existing"))
        if crs is not None:
            header.add_crs(pyproj.CRS(crs))
        las = laspy.LasData(header)
        las.points = laspy.ScaleAwarePointRecord.zeros(n, header=header)
        for axis in "XYZ":
            las[axis] = rng.integers(0, 10_000, n)
        for dimension in las.point_format.dimensions:
            if dimension.name in "XYZ" or dimension.name == "scanner_channel":
                continue
            shape = (n,) if dimension.num_elements == 1 else (n, dimension.num_elements)
            if dimension.kind == laspy.point.dims.DimensionKind.FloatingPoint:
                las[dimension.name] = rng.random(shape)
            else:
                bits = dimension.num_bits // dimension.num_elements
                las[dimension.name] = rng.integers(0, min(2**bits, 2**15), shape)
        las["classification"] = rng.integers(0, 22, n)
        path = tmp_path / name
        las.write(path)
        return path

    return make


@pytest.fixture
def patched(tmp_path: Path) -> Callable[..., Path]:
    """Writes a copy of a file with some bytes replaced, or cut off."""

    def patch(
        source: Path, at: dict[int, bytes] | None = None, cut: int | None = None, add: bytes = b""
    ) -> Path:
        data = bytearray(source.read_bytes())
        for position, new in (at or {}).items():
            data[position : position + len(new)] = new
        path = tmp_path / f"patched-{source.name}"
        path.write_bytes(bytes(data[:cut]) + add)
        return path

    return patch
