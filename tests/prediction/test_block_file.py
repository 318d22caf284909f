"""Blocks of records in a file, found by kind and number."""

from __future__ import annotations

import numpy as np

from scenenet.prediction.work.block_file import BlockFile, BlockWriter

NUMBER = np.dtype("<i4")


def test_blocks_of_a_number_are_read_in_the_order_in_which_they_were_written(tmp_path):
    path = tmp_path / "blocks"
    with path.open("wb") as stream:
        blocks = BlockWriter(stream, ("points", "voxels"))
        for kind, code, values in (
            ("points", 7, [1, 2]), ("voxels", 7, [9]), ("points", -3, [3]), ("points", 7, [0]),
            ("points", 2**62, [4]),
        ):  # fmt: skip
            blocks.add(kind, code, np.array(values, NUMBER))
        blocks.end({"of": "line"})
    file = BlockFile(path)
    assert file.facts == {"of": "line"}
    assert sorted(file.codes("points")) == [-3, 7, 2**62]
    assert file.read("points", 7, NUMBER).tolist() == [1, 2, 0]
    assert file.read("points", -3, NUMBER).tolist() == [3]
    assert file.read("points", 2**62, NUMBER).tolist() == [4]
    assert file.read("voxels", 7, NUMBER).tolist() == [9]
    assert file.read("voxels", -3, NUMBER).tolist() == []
