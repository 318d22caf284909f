"""The surveys of a run: the survey sheet, the inbox and the folder of TS40K samples."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from scenenet.config.inbox import inbox_surveys
from scenenet.config.survey import SAMPLE_SUFFIXES, Survey
from scenenet.config.survey_sheet import read_sheet
from scenenet.core.errors import InputError

if TYPE_CHECKING:
    from scenenet.config.schema import Config

TS40K = "ts40k"
"""Name of the survey made of the folder of TS40K samples."""


def read_surveys(
    config: Config, root: str | Path = ".", warn: Callable[[str], None] | None = None
) -> list[Survey]:
    """The surveys of the sheet, the TS40K folder and the inbox, in this order.

    A file of the inbox that the workflow cannot use stops no other; it is left out.

    Args:
        config: the configuration.
        root: folder that paths are relative to.
        warn: gets a sentence for each file that is left out; None prints it on stderr.

    Raises:
        InputError: something is wrong; all problems of the sheet are listed together, with the
            numbers of their lines.
    """
    root = Path(root)
    surveys = [] if config.surveys is None else read_sheet(config, root)
    surveys += _ts40k(config, root)
    surveys += inbox_surveys(
        config, root, surveys, warn or (lambda text: print(text, file=sys.stderr))
    )
    names: dict[str, Survey] = {}
    for survey in surveys:
        if survey.name in names:
            raise InputError(
                f"two surveys are called {survey.name!r}: {names[survey.name].path} and "
                f"{survey.path}",
                remedy="Rename one of them",
            )
        names[survey.name] = survey
    return surveys


def _ts40k(config: Config, root: Path) -> Iterator[Survey]:
    if config.ts40k_dir is None:
        return
    folder = root / config.ts40k_dir
    if not folder.is_dir() or not any(f.suffix in SAMPLE_SUFFIXES for f in folder.iterdir()):
        raise InputError(
            "there are no TS40K samples (.npy, .pt)",
            file=config.ts40k_dir,
            remedy="Name their folder, for example with --config ts40k_dir=FOLDER",
        )
    yield Survey(TS40K, config.ts40k_dir, config.ts40k_codes, "train", "ts40k")
