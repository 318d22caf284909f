"""The review files of a run: what people decided about the towers of new surveys."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from scenenet.config.schema import Config
from scenenet.core.settings import path_fault

REVIEW_SUFFIXES = (".csv", ".gpkg")


def find_reviews(
    config: Config, names: Iterable[str], root: str | Path, warn: Callable[[str], None]
) -> dict[str, list[str]]:
    """The review files of each survey, in the order of their names.

    ``NAME.csv``, ``NAME.gpkg``, ``NAME.anything.csv`` and ``NAME.anything.gpkg`` in the folder
    ``new_surveys.reviews`` belong to the survey NAME. Hidden files are skipped.

    Args:
        config: the configuration.
        names: of the new surveys.
        root: folder that paths are relative to.
        warn: gets a sentence for each file that belongs to no survey or cannot be used.

    Returns:
        survey -> paths, relative to the root of the project or absolute; only surveys with a file.
    """
    named = config.new_surveys.reviews
    if named is None or not (Path(root) / named).is_dir():
        return {}
    longest_first = sorted(names, key=len, reverse=True)
    found: dict[str, list[str]] = {}
    for file in sorted((Path(root) / named).iterdir()):
        if file.name.startswith(".") or file.suffix.lower() not in REVIEW_SUFFIXES:
            continue
        path = str(Path(named) / file.name)
        owner = next((name for name in longest_first if file.name.startswith(f"{name}.")), None)
        if fault := path_fault(path):
            warn(f"left out: {path}: the path {fault}. Rename the file")
        elif owner is None:
            listed = ", ".join(sorted(longest_first)) or "there is none"
            warn(
                f"left out: {path}: its name does not begin with that of a new survey ({listed}). "
                "Rename the file"
            )
        else:
            found.setdefault(owner, []).append(path)
    return found
