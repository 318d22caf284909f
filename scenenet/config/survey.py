"""A survey of a run: its name and its files."""

from __future__ import annotations

import errno
import glob
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from scenenet.pointcloud.class_schemes import Codes
from scenenet.prediction.tile_index import INDEX_SUFFIXES

Role = Literal["train", "observe", "new"]
Origin = Literal["file", "tiles", "synthetic", "ts40k"]

LAS_SUFFIXES = (".las", ".laz")
SAMPLE_SUFFIXES = (".npy", ".pt")

REPEATED = re.compile(r"(.+)\1{19}$")
"""Names that Snakemake takes for an endless recursion (``PeriodicWildcardError``)."""
REPEATS = "ends in 20 or more repetitions, which Snakemake refuses"


@dataclass(frozen=True)
class Survey:
    """A survey that the workflow works on.

    Attributes:
        name: unique; names its files.
        path: relative to the root of the project, or absolute.
        codes: class scheme of its labels.
        role: train, observe or new.
        origin: ``file`` for a recorded survey, ``tiles`` for one of many files, ``synthetic`` for
            one that the workflow makes, ``ts40k`` for a folder of samples.
        crs: the coordinate system if the file states none, as text; None if it is not known.
    """

    name: str
    path: str
    codes: Codes
    role: Role
    origin: Origin = "file"
    crs: str | None = None


def file_name(text: str) -> str:
    """``text`` made fit for a file name: letters, digits, '_', '-' and '.'."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", text).strip("_.-")[:100] or "survey"


def is_tiled(where: Path) -> bool:
    """Whether a path is a survey of many files: a folder, a pattern or a tile index."""
    if where.is_dir():
        files = [file.suffix.lower() for file in where.iterdir()]
        return not {*SAMPLE_SUFFIXES} & set(files) and bool({*LAS_SUFFIXES} & set(files))
    if not os.path.lexists(where):
        return glob.has_magic(str(where))
    return where.is_file() and where.suffix.lower() in INDEX_SUFFIXES


def unreachable(where: Path) -> str | None:
    """Why the system cannot reach ``where``; None if it can, or if nothing is there."""
    try:
        where.stat()
    except (FileNotFoundError, NotADirectoryError):
        if where.is_symlink():
            return f"it is a link to {where.readlink()}, which does not exist"
    except OSError as error:
        return "it is part of a loop of links" if error.errno == errno.ELOOP else error.strerror
    return None
