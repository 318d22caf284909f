"""TS40K samples are read without running anything that is in them."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from scenenet.core.errors import InputError
from scenenet.pointcloud import add_dimensions, iter_chunks, read, survey_info

POINTS = np.array([[544851.61, 4634539.49, 159.49, 15], [544880.48, 4634566.31, 223.57, 16]])


def save_npy(tmp_path, array):
    path = tmp_path / "sample_1.npy"
    np.save(path, array)
    return path


def save_pt(tmp_path, sample, **options):
    path = tmp_path / "sample_1.pt"
    torch.save(sample, path, **options)
    return path


class Trap:
    """The function that unpickling would call."""

    opened = False

    def __reduce__(self):
        return (print, ("a pickle ran",))


def test_an_array_gives_float64_coordinates_and_codes(tmp_path):
    cloud = read(save_npy(tmp_path, POINTS), "edp")
    np.testing.assert_array_equal(cloud.xyz, POINTS[:, :3])
    assert cloud.is_tower.tolist() == [True, False]
    assert cloud.crs is None


@pytest.mark.parametrize("dtype", ["<f4", ">f8", "<i4"])
def test_other_number_types_and_memory_orders_are_fine(tmp_path, dtype):
    cloud = read(save_npy(tmp_path, np.asfortranarray(POINTS.astype(dtype))), "edp")
    np.testing.assert_array_equal(cloud.xyz, POINTS.astype(dtype)[:, :3])


@pytest.mark.parametrize(
    ("array", "words"),
    [
        (POINTS[:, :3], r"\(2, 3\)"),
        (POINTS[0], r"\(4,\)"),
        (POINTS.astype(complex), "complex"),
        (np.where(POINTS == 15, 15.5, POINTS), r"row 0.*15\.5"),
        (np.where(POINTS == 16, 256, POINTS), r"row 1.*256"),
        (np.where(POINTS == 16, -1, POINTS), r"row 1.*-1"),
        (np.where(POINTS == 16, np.nan, POINTS), "row 1.*nan"),
        (np.where(POINTS == 223.57, np.inf, POINTS), "row 1.*inf"),
    ],
)
def test_an_array_of_something_else_is_refused_with_its_place(tmp_path, array, words):
    path = save_npy(tmp_path, array)
    with pytest.raises(InputError, match=words) as caught:
        read(path)
    assert str(path) in str(caught.value)


def test_an_array_of_objects_is_not_unpickled(tmp_path, capsys):
    path = save_npy(tmp_path, np.array([Trap(), 1, 2, 3], dtype=object))
    with pytest.raises(InputError, match="run code"):
        read(path)
    assert "a pickle ran" not in capsys.readouterr().out


@pytest.mark.parametrize("share", [0.1, 0.5, 0.95])
def test_a_truncated_array_is_refused(tmp_path, share):
    path = save_npy(tmp_path, np.tile(POINTS, (100, 1)))
    path.write_bytes(path.read_bytes()[: int(path.stat().st_size * share)])
    with pytest.raises(InputError):
        read(path)


def test_an_array_in_chunks(tmp_path):
    path = save_npy(tmp_path, np.tile(POINTS, (5, 1)))
    assert [len(chunk) for chunk in iter_chunks(path, "edp", 4)] == [4, 4, 2]
    assert survey_info(path).n_points == 10
    assert survey_info(path).maxs == tuple(POINTS[1, :3])
    empty = save_npy(tmp_path, np.empty((0, 4)))
    assert len(read(empty)) == 0


def test_damage_anywhere_is_an_error_or_points_and_nothing_else(tmp_path):
    rng = np.random.default_rng(0)
    save_npy(tmp_path, np.tile(POINTS, (5, 1)))
    save_pt(tmp_path, sample(torch.tensor([4, 5])))
    for path in sorted(tmp_path.iterdir()):
        whole = path.read_bytes()
        for _ in range(150):
            damaged = bytearray(whole)
            for at in rng.integers(0, rng.choice([128, len(whole)]), 5):
                damaged[at] = rng.integers(256)
            path.write_bytes(damaged)
            try:
                read(path)
            except InputError as error:
                assert str(path) in str(error)


def sample(labels):
    return {
        "type": "tower_radius",
        "input_pcd": torch.from_numpy(POINTS[:, :3].copy()),
        "semantic_labels": labels,
        "obj_boxes": [
            {
                "class_label": 4,
                "position": {"x": np.float64(1.5), "y": np.float32(2)},
                "rotation": 0,
            }
        ],
    }


@pytest.mark.parametrize("shape", [(2,), (2, 1), (1, 2)])
@pytest.mark.parametrize("zipped", [True, False])
def test_a_dictionary_of_tensors_is_read_in_every_shape_of_labels(tmp_path, shape, zipped):
    labels = torch.tensor([4, 5]).reshape(shape)
    path = save_pt(tmp_path, sample(labels), _use_new_zipfile_serialization=zipped)
    cloud = read(path, "ts40k")
    np.testing.assert_array_equal(cloud.xyz, POINTS[:, :3])
    assert cloud.classification.tolist() == [4, 5]
    assert cloud.is_tower.tolist() == [True, False]


def test_a_dictionary_with_a_pickled_object_is_refused_and_runs_nothing(tmp_path, capsys):
    path = save_pt(tmp_path, sample(torch.tensor([4, 5])) | {"type": Trap()})
    with pytest.raises(InputError, match="run code") as caught:
        read(path)
    assert str(path) in str(caught.value)
    assert "a pickle ran" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({"input_pcd": torch.zeros(2, 3)}, "semantic_labels"),
        (torch.zeros(2, 4), "Tensor"),
        (sample(torch.tensor([4, 5, 0])), r"\(3,\)"),
        (sample(torch.tensor([4, 5])) | {"input_pcd": torch.zeros(2, 4)}, r"\(2, 4\)"),
        (sample([4, 5]), "list"),
        (sample(torch.tensor([-1, 5])), "row 0"),
    ],
)
def test_a_dictionary_of_another_shape_is_refused(tmp_path, content, words):
    with pytest.raises(InputError, match=words):
        read(save_pt(tmp_path, content))


def test_the_refusal_of_an_object_names_it_and_gives_no_advice_to_load_it(tmp_path):
    sample = {"input_pcd": Trap(), "semantic_labels": torch.zeros(1)}
    path = save_pt(tmp_path, sample)
    with pytest.raises(InputError) as refused:
        read(path, codes="edp")
    message = str(refused.value)
    assert "objects other than tensors and numbers (print)" in message.replace("builtins.", "")
    assert "not loaded because they can run code. Save a dictionary with input_pcd" in message
    for advice in ("weights_only", "trust", "add_safe_globals", "two options"):
        assert advice not in message


@pytest.mark.parametrize("key", ["input_pcd", "semantic_labels"])
def test_a_tensor_that_repeats_one_number_is_refused_before_it_takes_memory(tmp_path, key):
    """2 kB that would be 24 TB."""
    sample = {"input_pcd": torch.zeros(10, 3), "semantic_labels": torch.zeros(10)}
    shape = (10**12, 3) if key == "input_pcd" else (10**12,)
    path = save_pt(tmp_path, sample | {key: torch.zeros(1).expand(shape)})
    assert path.stat().st_size < 3000
    with pytest.raises(InputError, match=rf"{key} has \d+ numbers, of which the file stores 1\."):
        read(path, codes="edp")


def test_a_part_of_a_larger_tensor_is_read(tmp_path):
    table = torch.arange(40, dtype=torch.float64).reshape(10, 4)
    path = save_pt(tmp_path, {"input_pcd": table[:, :3], "semantic_labels": table[:, 3] * 0 + 2})
    np.testing.assert_array_equal(read(path, codes="edp").xyz, table[:, :3].numpy())


@pytest.mark.parametrize("kind", ["sparse", "meta"])
def test_a_tensor_without_its_numbers_is_refused(tmp_path, kind):
    points = torch.ones(2, 3).to_sparse() if kind == "sparse" else torch.ones(2, 3, device="meta")
    path = save_pt(tmp_path, {"input_pcd": points, "semantic_labels": torch.zeros(2)})
    with pytest.raises(InputError, match="not a plain tensor of numbers"):
        read(path, codes="edp")


def test_a_damaged_dictionary_is_refused(tmp_path):
    path = save_pt(tmp_path, sample(torch.tensor([4, 5])))
    path.write_bytes(path.read_bytes()[:300])
    with pytest.raises(InputError, match="damaged"):
        read(path)
    path.write_bytes(b"not from torch")
    with pytest.raises(InputError):
        read(path)


def test_dimensions_are_added_to_a_sample_by_writing_it_as_laz(tmp_path):
    path, out = save_npy(tmp_path, POINTS), tmp_path / "out.laz"
    n = add_dimensions(path, out, {"height": "f4"}, lambda xyz: {"height": xyz[:, 2]})
    cloud = read(out)
    assert n == len(cloud) == 2
    np.testing.assert_allclose(cloud.xyz, POINTS[:, :3], rtol=0, atol=0.0005)
    assert cloud.classification.tolist() == [15, 16]
    assert survey_info(out).extra_dimensions == ("height",)


def test_the_public_crops_are_read(real_data):
    for path in sorted((real_data / "ts40k").glob("*.npy")):
        array, cloud = np.load(path), read(path, "edp")
        np.testing.assert_array_equal(cloud.xyz, array[:, :3])
        np.testing.assert_array_equal(cloud.classification, array[:, 3])
        assert cloud.is_tower.any()
