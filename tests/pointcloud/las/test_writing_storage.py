"""A disk or a limit that stops the compressor ends with a message and no file."""

from __future__ import annotations

import resource

import numpy as np
import pytest

from scenenet.core.errors import OutputError
from scenenet.pointcloud import PointCloud, write_las


@pytest.mark.parametrize("suffix", [".las", ".laz"])
@pytest.mark.parametrize(
    ("n", "limit"),
    [(200_000, 100_000), (200, 0), (200, 1000)],
    ids=["points", "all in the buffer", "a part"],
)
def test_a_file_that_cannot_grow_is_named_and_not_left(tmp_path, suffix, n, limit):
    xyz = np.random.default_rng(0).uniform(0, 100, (n, 3))
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, hard))
    try:
        with pytest.raises(OutputError, match=f"survey{suffix}: the file cannot be written"):
            write_las(tmp_path / f"survey{suffix}", PointCloud(xyz, np.zeros(len(xyz), np.uint8)))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert list(tmp_path.iterdir()) == []
