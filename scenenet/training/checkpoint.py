"""Checkpoints: the state from which an interrupted training continues.

A checkpoint is a safetensors file: the arrays of the state, and as metadata the identity of the
training and a record in JSON. It is written whole or not at all.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from scenenet.core.files import atomic, digest
from scenenet.dataset.voxels import VoxelSample
from scenenet.models.settings import ModelSettings


class State(NamedTuple):
    """The state of a training.

    Attributes:
        arrays: numbers that must come back to the last bit, by name.
        record: what JSON can hold, such as the rows of the history.
    """

    arrays: Mapping[str, np.ndarray]
    record: Any


class Checkpoint:
    """The checkpoint file of one training."""

    def __init__(self, path: str | Path | None, identity: str) -> None:
        """Name the file; nothing is read or written yet.

        Args:
            path: the file; None for a training without a checkpoint.
            identity: digest of everything that the training depends on (``identity_of``).
        """
        self._path = None if path is None else Path(path)
        self._identity = identity

    def write(self, state: State) -> None:
        """Replace the file by ``state``."""
        if self._path is None:
            return
        from safetensors.numpy import save_file

        arrays = {name: np.array(value, order="C") for name, value in state.arrays.items()}
        metadata = {"identity": self._identity, "record": json.dumps(state.record)}
        with atomic(self._path) as partial:
            save_file(arrays, partial, metadata=metadata)

    def read(self) -> State | None:
        """The last state that was written.

        Returns:
            None if there is no file, or if the file is damaged, of another training or of an
            earlier format. The training then starts from the beginning, which costs time and
            changes no result.
        """
        if self._path is None or not self._path.is_file():
            return None
        from safetensors import SafetensorError, safe_open

        try:
            with safe_open(self._path, framework="np") as stream:
                metadata = stream.metadata() or {}
                if metadata.get("identity") != self._identity or "record" not in metadata:
                    return None
                arrays = {name: stream.get_tensor(name) for name in list(stream.keys())}
        except SafetensorError:
            return None
        return State(arrays, json.loads(metadata["record"]))


def identity_of(
    training: Sequence[VoxelSample],
    validation: Sequence[VoxelSample],
    settings: ModelSettings,
    seed: int,
) -> str:
    """Digest of everything that a training depends on."""

    def summary(sample: VoxelSample) -> list[Any]:
        shape = None if sample.shape is None else sample.shape.plain()
        counts = len(sample.index), int(sample.index.sum()), int(sample.labelled.sum())
        return [sample.id, *counts, shape]

    samples = [[summary(sample) for sample in part] for part in (training, validation)]
    return digest([settings.model_dump(), seed, samples])
