"""Result files, read as JSON, as a type or as a table."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import pandas as pd

from scenenet.core.errors import InputError
from scenenet.core.files import read_json

Typed = TypeVar("Typed")


def read_result(path: Path) -> Mapping[str, Any]:
    """Read a JSON result.

    Raises:
        InputError: the file is missing or is not a JSON object.
    """
    try:
        data = read_json(path)
    except OSError as error:
        raise _unreadable(path, error.strerror or "cannot be read") from None
    except ValueError as error:
        raise _unreadable(path, f"is not JSON ({error})") from None
    if not isinstance(data, Mapping):
        raise _unreadable(path, "is not a JSON object")
    return data


def read_typed(path: Path, make: Callable[[Mapping[str, Any]], Typed]) -> Typed:
    """Read a JSON result as its type.

    Args:
        path: the file.
        make: the ``from_json`` of the type.

    Raises:
        InputError: the file is missing, is not a JSON object, or was written by another version.
    """
    data = read_result(path)
    try:
        return make(data)
    except (KeyError, TypeError) as error:
        raise _unreadable(path, f"is a result of another version ({error})") from None


def read_table(path: Path) -> pd.DataFrame:
    """Read a CSV result.

    Raises:
        InputError: the file is missing or is not a table.
    """
    try:
        return pd.read_csv(path)
    except OSError as error:
        raise _unreadable(path, error.strerror or "cannot be read") from None
    except ValueError as error:
        raise _unreadable(path, f"is not a table ({error})") from None


def _unreadable(path: Path, problem: str) -> InputError:
    return InputError(problem, file=path, remedy="Delete it and run the workflow again")
