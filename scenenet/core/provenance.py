"""What made a result: fingerprints of its inputs, and the record beside it."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from scenenet.core.errors import InputError
from scenenet.core.files import digest, sha256, write_text

FULL_BELOW_BYTES = 64 * 1024**2
"""Files from this size on are known by size and time, because reading them takes seconds."""

SAMPLE_SUFFIXES = frozenset({".las", ".laz", ".npy", ".pt"})
"""The files that count in a folder of samples."""


def fingerprint(path: str | Path, full_below_bytes: int = FULL_BELOW_BYTES) -> str:
    """A short text that is another one when the file is another one.

    Args:
        path: a file, or a folder of samples.
        full_below_bytes: up to this size the content counts, so that touching a file changes
            nothing; from there on size and modification time (ns), older times included.

    Returns:
        ``sha256:...`` or ``size-mtime:BYTES-NANOSECONDS``; for a folder ``folder:COUNT-...`` over
        the names and fingerprints of its samples, whose sizes are added up to decide how each is
        known. Folders inside of it do not count.

    Raises:
        InputError: there is no such file.
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


def record(
    stage: str,
    settings: Mapping[str, Any],
    inputs: Mapping[str, Any],
    code: str,
    config: str,
    seed: int | None = None,
) -> dict[str, Any]:
    """What a result was made from and by.

    Args:
        stage: name of the stage.
        settings: what the stage was set to.
        inputs: name of each input -> its fingerprint (or several, where an input is a list).
        code: ``scenenet.core.code_hash.code_hash`` of what computed it.
        config: digest of the settings.
        seed: of the random numbers, where the stage draws any.
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
    """Version of the installed package; ``unknown`` where it runs from a bare folder."""
    try:
        return version("scenenet")
    except PackageNotFoundError:
        return "unknown"


def write_settings(path: str | Path, settings: Mapping[str, Any]) -> None:
    """Write settings as YAML that can be given to the workflow again as its configuration."""
    import yaml

    head = f"# All settings of a run, defaults included. Digest: {digest(dict(settings))}\n"
    write_text(path, head + yaml.safe_dump(dict(settings), allow_unicode=True))
