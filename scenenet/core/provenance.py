"""What made a result: fingerprints of its inputs, and the record that is written with it."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from scenenet.core.errors import InputError
from scenenet.core.files import digest, sha256, write_text

FULL_BELOW_BYTES = 64 * 1024**2
"""Files of this size or more are identified by size and time, because reading them takes
seconds."""

SAMPLE_SUFFIXES = frozenset({".las", ".laz", ".npy", ".pt"})
"""Suffixes of the files that count in a folder of samples."""


def fingerprint(path: str | Path, full_below_bytes: int = FULL_BELOW_BYTES) -> str:
    """A short text that differs if the file differs.

    Args:
        path: a file, or a folder of samples.
        full_below_bytes: below this size the content counts, so that touching a file changes
            nothing; from this size on, size and modification time (ns) count.

    Returns:
        ``sha256:...`` or ``size-mtime:BYTES-NANOSECONDS``; for a folder ``folder:COUNT-...``
        over the names and fingerprints of its samples; their total size decides whether content
        or size and time count. Subfolders do not count.

    Raises:
        InputError: the file cannot be read.
    """
    path = Path(path)
    try:
        if path.is_dir():
            samples = sorted(p for p in path.iterdir() if p.suffix.lower() in SAMPLE_SUFFIXES)
            if sum(p.stat().st_size for p in samples) >= full_below_bytes:
                full_below_bytes = 0
            parts = [[p.name, fingerprint(p, full_below_bytes)] for p in samples]
            return f"folder:{len(parts)}-{digest(parts)}"
        status = path.stat()
        if status.st_size < full_below_bytes:
            return f"sha256:{sha256(path)}"
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", file=path) from None
    return f"size-mtime:{status.st_size}-{status.st_mtime_ns}"


def is_still(path: str | Path, known: str) -> bool:
    """Whether ``known`` is a fingerprint of the file or folder, whatever ``full_below_bytes`` was.

    Raises:
        InputError: the file cannot be read.
    """
    return any(fingerprint(path, limit) == known for limit in (0, sys.maxsize))


def record(
    stage: str,
    settings: Mapping[str, Any],
    inputs: Mapping[str, Any],
    code: str,
    config: str,
    seed: int | None = None,
) -> dict[str, Any]:
    """What made a result: the content of ``provenance.json``.

    Args:
        stage: name of the stage.
        settings: of the stage.
        inputs: name of each input -> its fingerprint (a list of them for an input of several
            files).
        code: ``scenenet.core.code_hash.code_hash`` of what computed it.
        config: digest of the settings.
        seed: of the random numbers; None if the stage draws none.
    """
    made_by = {
        "stage": stage,
        "settings": dict(settings),
        "inputs": dict(inputs),
        "code": code,
        "config": config,
        "version": package_version(),
    }
    return made_by if seed is None else made_by | {"seed": seed}


def package_version() -> str:
    """Version of the installed package; ``unknown`` if it is not installed."""
    try:
        return version("scenenet")
    except PackageNotFoundError:
        return "unknown"


def write_settings(path: str | Path, settings: Mapping[str, Any]) -> None:
    """Write settings as YAML that the workflow accepts as its configuration."""
    import yaml

    head = f"# All settings of a run, defaults included. Digest: {digest(dict(settings))}\n"
    write_text(path, head + yaml.safe_dump(dict(settings), allow_unicode=True))
