"""One zarr store per survey and stage, with a manifest that lists its content.

The store is a single zip file: unlike a folder of chunks it cannot lose a part unnoticed, and it
is written whole or not at all. The manifest has its digest; a stage reads the manifest and refuses
a store that does not match.
"""

from __future__ import annotations

import contextlib
import hashlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from scenenet.core.errors import InputError
from scenenet.core.files import atomic, read_json, sha256, write_json
from scenenet.dataset.file_steps import pack, unpack


class StoreWriter:
    """Writes named groups of arrays; see ``create``."""

    def __init__(self, root: Any) -> None:
        self._root = root
        self._digest = hashlib.sha256()
        self.count = 0

    def add(self, name: str, arrays: Mapping[str, np.ndarray]) -> None:
        """Store ``arrays`` as the group ``name``; coordinates as steps where they are such."""
        group = self._root.create_group(name)
        for key in sorted(arrays):
            array = np.ascontiguousarray(arrays[key])
            packed = pack(array)
            if packed is None:
                _write(group, key, array)
            else:
                parts, facts = packed
                inner = group.create_group(key, attributes=facts)
                for part in sorted(parts):
                    _write(inner, part, parts[part])
            self._digest.update(f"{name}/{key}/{array.dtype.str}{array.shape}".encode())
            self._digest.update(array.tobytes())
        self.count += 1

    @property
    def content(self) -> str:
        """Digest of the arrays; it depends on the data alone, not on the time of writing."""
        return self._digest.hexdigest()


@contextmanager
def create(store: str | Path, manifest: str | Path, facts: dict[str, Any]) -> Iterator[StoreWriter]:
    """Write a store and then its manifest, both whole or not at all.

    Args:
        store: path of the ``.zarr.zip`` file.
        manifest: path of the JSON file, in the same folder.
        facts: further entries of the manifest; may be filled until the block ends.
    """
    import zarr
    from zarr.storage import ZipStore

    with atomic(store) as partial:
        backing = ZipStore(partial, mode="w")
        try:
            writer = StoreWriter(zarr.create_group(backing))
            yield writer
        except BaseException:
            # Else zipfile closes it when it is collected, and prints that it cannot.
            with contextlib.suppress(OSError):
                backing.close()
            raise
        backing.close()
    head = {
        "store": Path(store).name,
        "sha256": sha256(store),
        "content": writer.content,
        "count": writer.count,
    }
    write_json(manifest, head | facts)


class StoreReader:
    """Reads a store through its manifest.

    Attributes:
        manifest: content of the manifest.
    """

    def __init__(self, manifest: str | Path) -> None:
        """Check the store against ``manifest`` and open it.

        Raises:
            InputError: the store is missing, or is not the one that the manifest was written for.
        """
        import zarr
        from zarr.storage import ZipStore

        remedy = "Delete its manifest and run again to create both"
        try:
            self.manifest = read_json(manifest)
            store = Path(manifest).parent / self.manifest["store"]
        except (OSError, ValueError, KeyError, TypeError) as error:
            problem = f"the manifest cannot be read ({type(error).__name__}: {error})"
            raise InputError(problem, file=manifest, remedy=remedy) from None
        if not store.is_file():
            raise InputError("the store is missing", file=store, remedy=remedy)
        if sha256(store) != self.manifest["sha256"]:
            raise InputError(
                "the store was changed after it was written", file=store, remedy=remedy
            )
        self._root = zarr.open_group(ZipStore(store, mode="r"), mode="r")

    def get(self, name: str) -> dict[str, np.ndarray]:
        """The arrays of group ``name``."""
        group: Any = self._root[name]
        found = {key: np.asarray(array[...]) for key, array in group.arrays()}
        for key, inner in group.groups():
            parts = {part: np.asarray(array[...]) for part, array in inner.arrays()}
            found[key] = unpack(parts, dict(inner.attrs))
        return found


def _write(group: Any, key: str, array: np.ndarray) -> None:
    """Write one array as one compressed chunk."""
    from zarr.codecs import BloscCodec

    compressor = BloscCodec(cname="zstd", clevel=5, shuffle="bitshuffle")
    chunks = tuple(max(1, n) for n in array.shape)
    group.create_array(key, data=array, chunks=chunks, compressors=compressor)
