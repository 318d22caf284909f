"""What model files say about code from outside the package, so that no other code answers.

A model file names a provided kernel or measurement with the digest of its file, and for an
installed package with its name and version. It makes no code run: the user provides the code
(``scenenet.core.provided_code``), and its digest is compared before it is run.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from scenenet.core.errors import InputError
from scenenet.core.provided_code import KERNELS, Provision
from scenenet.geneo.registry import is_registered

KEY = "source"
"""Key of the record in the entry of a GENEO; kernels of the package have none."""


class CodeMissing(InputError):
    """A model file is in order, and code that it needs is not there, or is another one."""


def record_of(name: str, kind: Provision = KERNELS, key: str = KEY) -> dict[str, Any]:
    """The record of a kernel or measurement under ``key``; empty for one of the package."""
    source = kind.source_named(name)
    return {} if source is None else {key: source.record()}


def require_kernels(geneos: Iterable[Mapping[str, Any]]) -> None:
    """Compare the kernels of a model file with those that are provided; no code is run.

    Args:
        geneos: the entries of the file, with ``kernel`` and the record.

    Raises:
        CodeMissing: a kernel is missing, or is another one than the model was trained with.
    """
    for entry in geneos:
        kernel = entry["kernel"]
        require(kernel, entry.get(KEY), KERNELS, of_package=is_registered(kernel))


def require(
    name: str, record: Mapping[str, str] | None, kind: Provision, *, of_package: bool
) -> None:
    """Compare what a model file says about code with what is provided; no code is run.

    Args:
        name, record: as they are in the file; None for code of the package.
        of_package: whether code of this name is in the package, or was registered by this process.

    Raises:
        CodeMissing: as ``require_kernels``.
    """
    source, noun = kind.source_named(name), kind.noun
    if record is None:
        if source is not None and not of_package:
            raise CodeMissing(
                f"it does not say which file its {noun} {name!r} had, so {source.where} may be "
                "another one",
                remedy="Train the model again",
            )
        return
    trained = f"the {noun} {name!r} of {_origin(record)}"
    if source is None and of_package:
        raise CodeMissing(
            f"it was trained with {trained}, and a {noun} of the package is called so now",
            remedy=f"Rename the file and its {noun}, and train the model again",
        )
    if source is None:
        raise CodeMissing(
            f"it needs {trained}, which is not provided",
            remedy=f"Give the file with {kind.option}, or in {kind.variable}. A model file runs "
            "no code by itself"
            if "file" in record
            else "Install that version of the package, if you trust it. A model file runs no "
            "code by itself",
        )
    if source.record()["sha256"] != record["sha256"]:
        raise CodeMissing(
            f"it was trained with {trained}, and {source.where} is another one (sha256 "
            f"{source.sha256[:12]})",
            remedy="Provide the file that it was trained with, or train the model again",
        )
    if source.version != record.get("version"):
        raise CodeMissing(
            f"it was trained with {trained}, and {source.where} provides it now",
            remedy="Install the version that it was trained with, or train the model again",
        )


def _origin(record: Mapping[str, str]) -> str:
    digest = f"sha256 {record['sha256'][:12]}"
    if "file" in record:
        return f"the file {record['file']} ({digest})"
    return f"the package {record['distribution']} {record['version']} ({digest})"
