"""A survey in tiles has the prediction of the survey in one piece."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from fixtures.spools import spool_of
from hypothesis import given, settings
from hypothesis import strategies as st

from scenenet.convolution.occupancy import Occupancy
from scenenet.core.errors import InputError
from scenenet.models.cnn import CNN
from scenenet.models.scenenet import SceneNet
from scenenet.prediction.work.block_file import BlockFile, BlockWriter
from scenenet.prediction.work.lattice import EDGE, Lattice, code_of, groups
from scenenet.prediction.work.tile_predictions import (
    PREDICTED_KINDS,
    TilePrediction,
    TilePredictions,
)
from scenenet.prediction.work.tile_predictor import AT_ONCE, MOST_AT_ONCE, TilePredictor, _together
from scenenet.prediction.work.tiling import Tile, TileSpool

ORIGIN = np.array([500_000.0, 4_630_000.0, 100.0])


def survey(seed: int = 0, n: int = 20_000, extent=(150.0, 90.0, 30.0)) -> np.ndarray:
    """Points over several tiles; those at the lower left have negative numbers."""
    rng = np.random.default_rng(seed)
    return rng.uniform([-20, -20, -10], extent, (n, 3))


def spooled(folder, xyz, voxel_size=1.0, chunk=None) -> TileSpool:
    chunks = np.array_split(xyz, 1 if chunk is None else -(-len(xyz) // chunk))
    return spool_of(folder / "work", voxel_size, chunks)


def voxels_of(spool: TileSpool) -> dict[tuple[int, ...], int]:
    return {
        tuple(zyx): int(count)
        for tile in spool.tiles()
        for zyx, count in zip(tile.zyx().tolist(), tile.count, strict=True)
    }


def test_every_point_is_counted_in_its_voxel(tmp_path):
    xyz = survey()
    steps, counts = np.unique(np.floor(xyz[:, ::-1] / 0.7), axis=0, return_counts=True)
    expected = dict(zip(map(tuple, steps.astype(int).tolist()), counts.tolist(), strict=True))
    assert voxels_of(spooled(tmp_path, xyz, 0.7)) == expected


def test_no_points_are_no_tiles(tmp_path):
    spool = spooled(tmp_path, np.empty((0, 3)))
    assert len(spool) == 0
    assert list(spool.tiles()) == []


def test_chunks_do_not_matter(tmp_path):
    xyz = survey(n=3000)
    for name in ("whole", "pieces"):
        (tmp_path / name).mkdir()
    whole = spooled(tmp_path / "whole", xyz)
    assert voxels_of(spooled(tmp_path / "pieces", xyz, chunk=71)) == voxels_of(whole)


def test_the_centre_of_a_voxel_lies_in_it(tmp_path):
    xyz = survey(n=500) + ORIGIN
    spool = spooled(tmp_path, xyz, 0.9)
    centres = np.concatenate([spool.centres(tile.zyx()) for tile in spool.tiles()])
    code, voxel = spool.lattice.locate(centres)
    again = {(c, v) for c, v in zip(code.tolist(), voxel.tolist(), strict=True)}
    assert again == set(zip(*(a.tolist() for a in spool.lattice.locate(xyz)), strict=True))
    assert len(again) == len(centres)


def test_a_halo_has_the_voxels_of_the_neighbours(tmp_path):
    spool = spooled(tmp_path, survey())
    reach = (3, 5, 2)
    everything = voxels_of(spool)
    shape = np.array([EDGE + 2 * r for r in reach])
    for _, place in spool.places():
        scene = spool.around(place, reach)
        low = np.array(place) * EDGE - reach
        zyx = np.stack(np.unravel_index(scene.voxel, shape), axis=1) + low
        found = dict(zip(map(tuple, zyx.tolist()), scene.count.tolist(), strict=True))
        inside = {
            key: count
            for key, count in everything.items()
            if np.all(np.array(key) >= low) and np.all(np.array(key) < low + shape)
        }
        assert found == inside


def test_a_halo_wider_than_a_tile_is_refused(tmp_path):
    with pytest.raises(ValueError, match="larger than a tile"):
        spooled(tmp_path, survey(n=10)).around((0, 0, 0), (EDGE + 1, 0, 0))


def test_a_tile_without_points_is_empty(tmp_path):
    spool = spooled(tmp_path, survey(n=10))
    far = spool.tile(code_of((500, 500, 500)))
    assert len(far.voxel) == 0
    assert far.place == (500, 500, 500)


@pytest.mark.parametrize("stray", [[1e9, 0, 0], [0, -1e12, 0], [0, 0, np.nan], [np.inf, 0, 0]])
def test_a_point_outside_the_lattice_is_named(tmp_path, stray):
    xyz = np.array([[0.0, 0, 0], stray])
    message = r"the point \[.*\] is too far from the origin.*Remove stray"
    with pytest.raises(InputError, match=message):
        spooled(tmp_path, xyz)


@given(
    st.integers(-(10**7), 10**7),
    st.sampled_from([0.001, 0.01, 0.0025, 0.1]),
    st.sampled_from([0.1, 0.3, 0.5, 1.0]),
    st.integers(-(10**9), 10**9),
)
def test_the_offset_of_a_file_does_not_move_a_point_to_another_voxel(number, scale, size, offset):
    """A point on the lower border of a voxel belongs to it, however the file stores the place."""
    steps = number * round(size / scale)
    x = (steps - offset) * scale + offset * scale  # integer times scale plus offset, as in LAS
    lattice = Lattice(size)
    place, middle = (lattice.locate(np.full((1, 3), at)) for at in (x, (number + 0.5) * size))
    np.testing.assert_array_equal(np.concatenate(place), np.concatenate(middle))


@given(st.lists(st.integers(-3, 3), max_size=30))
def test_groups_have_the_rows_of_each_code(codes):
    found = dict(groups(np.array(codes, np.int64)))
    assert sorted(found) == sorted(set(codes))
    for code, rows in found.items():
        assert rows.tolist() == [i for i, c in enumerate(codes) if c == code]


def seamless(spool: TileSpool, model, measurement: str) -> tuple[np.ndarray, np.ndarray]:
    """Probability at every occupied voxel: in tiles, and in one dense piece."""
    voxels = voxels_of(spool)
    fullest = max(voxels.values())
    predict = TilePredictor(model, measurement, spool.voxel_size, fullest)
    in_tiles = {}
    tiles = list(spool.tiles())
    together = predict(spool, tiles)
    for tile, (probability, shares) in zip(tiles, together, strict=True):
        ((alone, alone_shares),) = predict(spool, [tile])
        np.testing.assert_array_equal(probability, alone)
        np.testing.assert_array_equal(shares, alone_shares)
        in_tiles |= dict(zip(map(tuple, tile.zyx().tolist()), probability.tolist(), strict=True))
    zyx = np.array(list(voxels))
    low = zyx.min(axis=0)
    shape = tuple((zyx.max(axis=0) - low + 1).tolist())
    flat = np.ravel_multi_index(tuple((zyx - low).T), shape)
    counts, order = np.array(list(voxels.values())), np.argsort(flat)
    phi = counts / fullest if measurement == "density" else np.ones(len(flat))
    with torch.no_grad():
        scene = Occupancy.of_grids([flat[order]], [phi[order]], shape)
        whole = model(scene).numpy().ravel()[flat]
    return np.array([in_tiles[tuple(v)] for v in zyx.tolist()]), whole


@pytest.mark.parametrize("measurement", ["presence", "density"])
@pytest.mark.parametrize(
    "model",
    [
        SceneNet(generator=torch.Generator().manual_seed(1)),
        SceneNet(kernel_size=(15, 4, 6), generator=torch.Generator().manual_seed(1)),
        CNN(3, (4, 7, 3), generator=torch.Generator().manual_seed(0)),
    ],
    ids=["scenenet", "even kernel", "cnn"],
)
def test_tiles_give_the_prediction_of_the_whole_survey(tmp_path, model, measurement):
    spool = spooled(tmp_path, survey(n=6000))
    assert len(spool) >= 8
    in_tiles, whole = seamless(spool, model, measurement)
    assert 0 < np.count_nonzero(whole) < len(whole)
    np.testing.assert_allclose(in_tiles, whole, rtol=0, atol=2e-5)


def test_tiles_of_few_voxels_are_predicted_together():
    def tiles(*sizes: int) -> list[Tile]:
        return [Tile((0, 0, i), np.arange(n, dtype=np.int32), None) for i, n in enumerate(sizes)]

    given = tiles(AT_ONCE, 1, 1, AT_ONCE, *[1] * (MOST_AT_ONCE + 1))
    together = list(_together(iter(given)))
    assert [len(group) for group in together] == [1, 3, MOST_AT_ONCE, 1]
    assert [tile for group in together for tile in group] == given
    assert list(_together([])) == []


@pytest.mark.parametrize("n_shares", [0, 3])
def test_the_prediction_of_a_tile_is_read_back_as_it_was_saved(tmp_path, n_shares):
    rng = np.random.default_rng(0)
    saved = TilePrediction(
        voxel=np.arange(5, dtype=np.int32),
        probability=rng.random(5, np.float32),
        shares=rng.random((5, n_shares), np.float32),
    )
    with (tmp_path / "tiles").open("wb") as stream:
        blocks = BlockWriter(stream, PREDICTED_KINDS)
        blocks.add("predictions", 7, saved.records())
        blocks.end({"geneos": [str(number) for number in range(n_shares)]})
    back = TilePredictions([BlockFile(tmp_path / "tiles")]).read(7)
    for name, expected in vars(saved).items():
        found = getattr(back, name)
        assert found.dtype == expected.dtype
        np.testing.assert_array_equal(found, expected)


@settings(max_examples=10)
@given(st.tuples(*[st.integers(-70, 70)] * 3), st.integers(0, 99))
def test_the_position_of_tiles_has_no_effect(tmp_path_factory, shift, seed):
    model = SceneNet(kernel_size=(5, 5, 5), generator=torch.Generator().manual_seed(seed))
    rng = np.random.default_rng(seed)
    xyz = rng.integers(-8, 8, (300, 3)) + 0.5  # centres of voxels around the corner of a tile
    predictions = []
    for moved in (xyz, xyz + np.array(shift)[::-1]):
        spool = spooled(tmp_path_factory.mktemp("tiles"), moved)
        found = {}
        predict = TilePredictor(model, "presence", spool.voxel_size, 1)
        for tile in spool.tiles():
            ((probability, _),) = predict(spool, [tile])
            found |= dict(zip(map(tuple, tile.zyx().tolist()), probability.tolist(), strict=True))
        predictions.append(found)
    here, there = predictions
    assert len(here) == len(there)
    for zyx, probability in here.items():
        assert there[tuple((np.array(zyx) + shift).tolist())] == pytest.approx(
            probability, abs=1e-5
        )
