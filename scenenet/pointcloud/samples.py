"""Files that are single crops: the samples of TS40K."""

from __future__ import annotations

from pathlib import Path

from scenenet.errors import InputError

SAMPLE_SUFFIXES = (".npy", ".pt")


def sample_files(path: str | Path) -> list[Path]:
    """The TS40K samples at ``path``: the file itself, or those in the folder, by name.

    Returns:
        an empty list where ``path`` is a survey (a LAS, LAZ or COPC file).

    Raises:
        InputError: ``path`` is a folder without samples.
    """
    path = Path(path)
    if path.is_dir():
        samples = sorted(f for f in path.iterdir() if f.suffix in SAMPLE_SUFFIXES)
        if not samples:
            raise InputError(
                "the folder holds no TS40K sample",
                file=path,
                remedy="Name a folder of .npy or .pt samples; surveys are named one by one",
            )
        return samples
    return [path] if path.suffix in SAMPLE_SUFFIXES else []
