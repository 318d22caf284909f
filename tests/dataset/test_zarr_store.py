"""A store and its manifest belong together, and are written whole or not at all."""

from __future__ import annotations

import gc
import resource

import numpy as np
import pytest

from scenenet.core.errors import InputError, OutputError
from scenenet.core.files import read_json
from scenenet.dataset.zarr_store import StoreReader, create

ARRAYS = {
    "xyz": np.arange(12, dtype=np.float64).reshape(4, 3) + 4_630_000.125,
    "code": np.array([2, 15, 15, 7], np.uint8),
    "nothing": np.empty(0, np.int32),
}


def write(folder, arrays=ARRAYS):
    folder.mkdir(exist_ok=True)
    with create(folder / "s.zarr.zip", folder / "m.json", {"survey": "a"}) as writer:
        writer.add("a-0001", arrays)
        writer.add("a-0002", {"code": arrays["code"]})
    return folder / "m.json"


def test_arrays_come_back_bit_for_bit(tmp_path):
    reader = StoreReader(write(tmp_path))
    back = reader.get("a-0001")
    assert back.keys() == ARRAYS.keys()
    for name, array in ARRAYS.items():
        assert back[name].dtype == array.dtype
        np.testing.assert_array_equal(back[name], array)
    assert reader.get("a-0002").keys() == {"code"}


def test_the_manifest_lists_the_content(tmp_path):
    manifest = read_json(write(tmp_path))
    assert manifest["store"] == "s.zarr.zip"
    assert manifest["survey"] == "a"
    assert manifest["count"] == 2
    assert len(manifest["sha256"]) == len(manifest["content"]) == 64


def test_same_data_same_content_digest(tmp_path):
    first, again = (read_json(write(tmp_path / name)) for name in ("first", "again"))
    assert first["content"] == again["content"]


@pytest.mark.parametrize(
    "other",
    [
        ARRAYS | {"code": np.array([2, 15, 15, 8], np.uint8)},
        ARRAYS | {"code": ARRAYS["code"].astype(np.int32)},
        ARRAYS | {"xyz": ARRAYS["xyz"].reshape(3, 4)},
    ],
    ids=["a number", "a type", "a shape"],
)
def test_other_data_other_content_digest(tmp_path, other):
    first, second = read_json(write(tmp_path / "a")), read_json(write(tmp_path / "b", other))
    assert first["content"] != second["content"]


def test_a_missing_store_is_named_with_a_remedy(tmp_path):
    manifest = write(tmp_path)
    (tmp_path / "s.zarr.zip").unlink()
    with pytest.raises(InputError, match=r"s\.zarr\.zip: the store is missing\. Delete its man"):
        StoreReader(manifest)


def test_a_store_with_one_byte_changed_is_refused_with_a_remedy(tmp_path):
    manifest = write(tmp_path)
    store = tmp_path / "s.zarr.zip"
    damaged = bytearray(store.read_bytes())
    damaged[len(damaged) // 2] ^= 1
    store.write_bytes(damaged)
    with pytest.raises(InputError, match=r"s\.zarr\.zip: the store was changed.*run again"):
        StoreReader(manifest)


def test_a_store_of_another_run_is_refused(tmp_path):
    manifest = write(tmp_path)
    write(tmp_path / "other", {"code": np.zeros(3, np.uint8)})
    (tmp_path / "other" / "s.zarr.zip").replace(tmp_path / "s.zarr.zip")
    with pytest.raises(InputError, match="changed"):
        StoreReader(manifest)


def test_an_interrupted_write_leaves_nothing(tmp_path):
    with (
        pytest.raises(KeyboardInterrupt),
        create(tmp_path / "s.zarr.zip", tmp_path / "m.json", {}) as writer,
    ):
        writer.add("a-0001", ARRAYS)
        raise KeyboardInterrupt
    assert list(tmp_path.iterdir()) == []


def test_a_store_that_cannot_grow_ends_with_one_message(tmp_path):
    """What zipfile would print when it is collected fails the test, too (filterwarnings)."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, hard))
    try:
        with (
            pytest.raises(OutputError, match="limit on file sizes"),
            create(tmp_path / "s.zarr.zip", tmp_path / "m.json", {}) as writer,
        ):
            writer.add("a-0001", ARRAYS)
        gc.collect()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert list(tmp_path.iterdir()) == []


def test_an_empty_store_is_a_store(tmp_path):
    with create(tmp_path / "s.zarr.zip", tmp_path / "m.json", {"crops": []}):
        pass
    assert StoreReader(tmp_path / "m.json").manifest["count"] == 0


@pytest.mark.parametrize("digits", [3, None], ids=["steps of a millimetre", "any numbers"])
def test_coordinates_come_back_bit_for_bit_and_steps_take_less_space(tmp_path, digits):
    low = np.array([545_000.0, 4_634_000.0, 200.0])
    xyz = np.random.default_rng(0).uniform(low, low + 80, (20_000, 3))
    xyz = xyz if digits is None else np.round(xyz, digits)
    manifest = write(tmp_path, {"xyz": xyz, "code": ARRAYS["code"]})
    assert StoreReader(manifest).get("a-0001")["xyz"].tobytes() == xyz.tobytes()
    size = (tmp_path / "s.zarr.zip").stat().st_size
    assert (size < 8 * len(xyz)) == (digits is not None)
