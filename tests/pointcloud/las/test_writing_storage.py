"""A disk or a limit that stops the compressor ends with a message and no file."""

from __future__ import annotations

import resource

import numpy as np
import pytest

from scenenet.core.errors import OutputError
from scenenet.pointcloud import PointCloud, write_las


@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_a_file_that_cannot_grow_is_named_and_not_left(tmp_path, suffix):
    xyz = np.random.default_rng(0).uniform(0, 100, (200_000, 3))
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, hard))
    try:
        with pytest.raises(OutputError, match=f"survey{suffix}: the file cannot be written"):
            write_las(tmp_path / f"survey{suffix}", PointCloud(xyz, np.zeros(len(xyz), np.uint8)))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert list(tmp_path.iterdir()) == []
