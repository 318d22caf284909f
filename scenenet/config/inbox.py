"""The inbox: a folder of surveys that are only classified."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from scenenet.config.survey import (
    LAS_SUFFIXES,
    REPEATED,
    REPEATS,
    Origin,
    Survey,
    file_name,
    is_tiled,
    unreachable,
)
from scenenet.core.settings import path_fault

if TYPE_CHECKING:
    from scenenet.config.schema import Config


def inbox_surveys(
    config: Config, root: Path, known: list[Survey], warn: Callable[[str], None]
) -> Iterator[Survey]:
    """LAS and LAZ files of the inbox, and folders of them, that the sheet does not name. Hidden
    ones are skipped: copy programs write to a hidden file until they have finished."""
    if config.new_surveys.folder is None or not (root / config.new_surveys.folder).is_dir():
        return
    listed = {os.path.realpath(root / survey.path) for survey in known}
    files = []
    for file in sorted((root / config.new_surveys.folder).iterdir()):
        if file.name.startswith(".") or os.path.realpath(file) in listed:
            continue
        if file.is_dir() and not is_tiled(file):
            folder = Path(config.new_surveys.folder) / file.name
            warn(f"left out: {folder}: it is not a folder of LAS and LAZ files")
        elif file.is_dir() or file.suffix.lower() in LAS_SUFFIXES:
            files.append(file)
    owners: dict[str, list[str]] = {survey.name: [survey.path] for survey in known}
    for file in files:
        owners.setdefault(_inbox_name(file), []).append(file.name)
    for file in files:
        path, name = str(Path(config.new_surveys.folder) / file.name), _inbox_name(file)
        reason = _why_left_out(file, path, name, owners[name])
        if reason is None:
            origin: Origin = "tiles" if file.is_dir() else "file"
            yield Survey(name, path, config.new_surveys.codes, "new", origin)
        else:
            warn(f"left out: {path}: {reason}")


def _inbox_name(file: Path) -> str:
    return file_name(file.name if file.is_dir() else file.stem.removesuffix(".copc"))


def _why_left_out(file: Path, path: str, name: str, owners: list[str]) -> str | None:
    """Why a file of the inbox cannot be a survey of the workflow; None if it can.

    Args:
        path: of the file, relative to the root of the project.
        name: of its survey.
        owners: the files whose survey would be called ``name``. None of those in the inbox is used,
            as one would replace the results of the other.
    """
    if fault := unreachable(file):
        return f"{fault}. Mend or remove it"
    if fault := path_fault(path):
        return f"the path {fault}. Rename the file"
    if REPEATED.search(name):
        return f"the name {REPEATS}. Rename the file"
    if len(owners) > 1:
        return f"two surveys would be called {name!r}: {' and '.join(owners)}. Rename one of them"
    return None
