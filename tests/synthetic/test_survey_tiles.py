"""A synthetic line in tiles has the points of the line in one file."""

from __future__ import annotations

import contextlib

import laspy
import numpy as np
import pytest

from scenenet.synthetic import SyntheticSettings, make_corridor, make_survey, tile_names
from scenenet.synthetic.survey_tiles import tiled_stream

SMALL = SyntheticSettings(towers=4, seed=3, density=2, tower_density=4)


def stored(*paths) -> np.ndarray:
    """The points and codes of files, sorted."""
    rows = [np.column_stack([p.X, p.Y, p.Z, p.classification]) for p in map(laspy.read, paths)]
    table = np.concatenate(rows)
    return table[np.lexsort(table.T)]


@pytest.mark.parametrize("tiles", [1, 3, 12])
def test_tiles_have_all_points_of_the_line_once(tmp_path, tiles):
    whole = make_survey(SMALL, tmp_path / "line.laz", truth=tmp_path / "truth.laz")
    folders = tmp_path / "tiles", tmp_path / "true"
    assert make_survey(SMALL, folders[0], truth=folders[1], tiles=tiles) == whole
    for folder, name in zip(folders, ("line.laz", "truth.laz"), strict=True):
        files = sorted(folder.iterdir())
        assert [file.name for file in files] == tile_names(tiles)
        np.testing.assert_array_equal(stored(*files), stored(tmp_path / name))


def test_tiles_lie_one_after_another_and_few_are_open_at_once(tmp_path):
    corridor, written, now, most = make_corridor(SMALL), {}, set(), 0

    @contextlib.contextmanager
    def stream(path):
        nonlocal most
        assert path not in written
        now.add(path)
        written[path] = []
        most = max(most, len(now))
        yield lambda xyz, codes: written[path].append(xyz[:, :2])
        now.remove(path)

    with tiled_stream(tmp_path, corridor, 5, stream) as write:
        for stretch in corridor:
            write(stretch.xyz, stretch.labels)
    assert len(written) == 5 and not now and most <= 4
    towers = np.array([(tower.x, tower.y) for tower in corridor.towers])
    along = (towers[-1] - towers[0]) / np.linalg.norm(towers[-1] - towers[0])
    middles = [np.median(np.concatenate(written[path]) @ along) for path in sorted(written)]
    steps = np.diff(middles)
    assert steps.min() > 0.5 * steps.mean()
