"""What model files say about kernels from outside the package, so that no other code answers.

A model file names such a kernel with the digest of its file, and for an installed package with its
name and version. It makes no code run: the user provides the kernel
(``scenenet.core.provided_kernels``), and its digest is compared before it is run.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from scenenet.core.errors import InputError
from scenenet.core.provided_kernels import VARIABLE, source_named
from scenenet.geneo.registry import is_registered

KEY = "source"
"""Key of the record in the entry of a GENEO; kernels of the package have none."""


class KernelMissing(InputError):
    """A model file is in order, and a kernel that it needs is not there, or is another one."""


def record_of(kernel: str) -> dict[str, Any]:
    """The record of a kernel under its key; empty for a kernel of the package."""
    source = source_named(kernel)
    return {} if source is None else {KEY: source.record()}


def require_kernels(geneos: Iterable[Mapping[str, Any]]) -> None:
    """Compare the kernels of a model file with those that are provided; no code is run.

    Args:
        geneos: the entries of the file, with ``kernel`` and the record.

    Raises:
        KernelMissing: a kernel is missing, or is another one than the model was trained with.
    """
    for entry in geneos:
        _require(entry["kernel"], entry.get(KEY))


def _require(kernel: str, record: Mapping[str, str] | None) -> None:
    source = source_named(kernel)
    if record is None:
        if source is not None and not is_registered(kernel):
            raise KernelMissing(
                f"it does not say which file its kernel {kernel!r} had, so {source.where} may be "
                "another one",
                remedy="Train the model again",
            )
        return
    trained = f"the kernel {kernel!r} of {_origin(record)}"
    if source is None and is_registered(kernel):
        raise KernelMissing(
            f"it was trained with {trained}, and a kernel of the package is called so now",
            remedy="Rename the file and its kernel, and train the model again",
        )
    if source is None:
        raise KernelMissing(
            f"it needs {trained}, which is not provided",
            remedy=f"Give the file with --kernels, or in {VARIABLE}. A model file runs no code "
            "by itself"
            if "file" in record
            else "Install that version of the package, if you trust it. A model file runs no "
            "code by itself",
        )
    if source.record()["sha256"] != record["sha256"]:
        raise KernelMissing(
            f"it was trained with {trained}, and {source.where} is another one (sha256 "
            f"{source.sha256[:12]})",
            remedy="Provide the file that it was trained with, or train the model again",
        )
    if source.version != record.get("version"):
        raise KernelMissing(
            f"it was trained with {trained}, and {source.where} provides it now",
            remedy="Install the version that it was trained with, or train the model again",
        )


def _origin(record: Mapping[str, str]) -> str:
    digest = f"sha256 {record['sha256'][:12]}"
    if "file" in record:
        return f"the file {record['file']} ({digest})"
    return f"the package {record['distribution']} {record['version']} ({digest})"
