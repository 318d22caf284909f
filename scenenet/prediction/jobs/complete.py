"""Says which files of a survey are not predicted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from scenenet.core.errors import InputError


def require_all_predicted(files: Sequence[Mapping[str, Any]], status: str | Path) -> None:
    """Fail where a file of a survey was not predicted.

    Args:
        files: of the summary of the survey.
        status: where they are listed.

    Raises:
        InputError: names each file that was not, and why.
    """
    failed = [file for file in files if file["error"]]
    if failed:
        reasons = "".join(f"\n  {file['status']}: {file['error']}" for file in failed)
        raise InputError(
            f"{len(failed)} of {len(files)} tiles are not predicted; the others are, with all that "
            f"follows from them:{reasons}",
            file=status,
            remedy="Correct these tiles or remove them, and run the workflow again",
        )
