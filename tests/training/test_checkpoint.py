"""Checkpoints: the same numbers back, and nothing from a file that does not fit."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

import numpy as np
import pytest
from safetensors.numpy import save_file

from scenenet.training.checkpoint import Checkpoint, State

STATE = State(
    {"a": np.array([0.1, 1 / 3, 1e-300]), "step": np.array(7.0, np.float32)},
    {"history": [{"loss": 0.1 + 0.2, "validation_f05": float("nan")}]},
)


def test_what_was_written_is_read_to_the_last_bit(tmp_path):
    checkpoint = Checkpoint(tmp_path / "c", "identity")
    checkpoint.write(STATE)
    arrays, record = checkpoint.read()
    assert arrays.keys() == STATE.arrays.keys()
    for name, value in STATE.arrays.items():
        assert arrays[name].dtype == value.dtype
        assert arrays[name].shape == value.shape
        assert arrays[name].tobytes() == value.tobytes()
    assert record["history"][0]["loss"] == 0.1 + 0.2
    assert np.isnan(record["history"][0]["validation_f05"])


def test_a_state_without_arrays_can_be_written(tmp_path):
    checkpoint = Checkpoint(tmp_path / "c", "identity")
    checkpoint.write(State({}, [1, 2]))
    assert checkpoint.read() == ({}, [1, 2])


def test_without_a_path_nothing_is_written_or_read(tmp_path):
    checkpoint = Checkpoint(None, "identity")
    checkpoint.write(STATE)
    assert checkpoint.read() is None
    assert not list(tmp_path.iterdir())


def test_a_file_of_another_training_is_not_read(tmp_path):
    Checkpoint(tmp_path / "c", "identity").write(STATE)
    assert Checkpoint(tmp_path / "c", "another").read() is None


@pytest.mark.parametrize("size", [0, 7, 40, -1])
def test_a_damaged_file_is_not_read(tmp_path, size):
    checkpoint = Checkpoint(tmp_path / "c", "identity")
    checkpoint.write(STATE)
    content = (tmp_path / "c").read_bytes()
    (tmp_path / "c").write_bytes(content[:size])
    assert checkpoint.read() is None


@pytest.mark.parametrize("key", ["history", "state"])
def test_a_file_of_version_0_1_is_not_read(tmp_path, key):
    """It had a key for each part in the place of the record."""
    metadata = {"identity": "identity", key: "[]"}
    save_file({"model/bias": np.zeros(3, np.float32)}, tmp_path / "c", metadata=metadata)
    assert Checkpoint(tmp_path / "c", "identity").read() is None


WRITER = """
import sys
import numpy as np
from scenenet.training.checkpoint import Checkpoint, State

checkpoint = Checkpoint(sys.argv[1], "identity")
for number in range(10**9):
    checkpoint.write(State({"a": np.full(200_000, float(number))}, number))
    if number == 3:
        print("ready", flush=True)
"""


def test_a_kill_while_writing_leaves_a_whole_checkpoint(tmp_path):
    path = tmp_path / "c"
    writer = subprocess.Popen(
        [sys.executable, "-c", WRITER, str(path)], stdout=subprocess.PIPE, text=True
    )
    assert writer.stdout.readline() == "ready\n"
    os.kill(writer.pid, signal.SIGKILL)
    assert writer.wait(timeout=60) == -signal.SIGKILL
    writer.stdout.close()
    arrays, number = Checkpoint(path, "identity").read()
    assert number >= 3
    assert (arrays["a"] == number).all()
