"""The numbers published in the thesis (``config/thesis.yaml``), for comparison."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from pydantic import Field, ValidationError

from scenenet.core.errors import InputError
from scenenet.core.settings import Settings


class Published(Settings):
    """One published number, or a range if the thesis gives only a range."""

    value: float | None = Field(None, description="the number, in `unit`")
    spread: float | None = Field(None, description="its standard deviation, if published")
    low: float | None = Field(None, description="lower bound of the published range")
    high: float | None = Field(None, description="upper bound of the published range")
    unit: str | None = Field(
        None, description="unit; null for counts and for shares between 0 and 1"
    )
    place: str = Field(description="section, table or figure of the thesis")
    what: str | None = Field(None, description="meaning of the number")


class Thesis(Settings):
    """Every published number by a dotted name such as ``models.cnn.precision``."""

    source: str = Field(description="the publication")
    numbers: Mapping[str, Published] = Field(description="name -> number")

    def number(self, name: str) -> Published | None:
        """The number called ``name``; None where the thesis has no such number."""
        return self.numbers.get(name)

    def value(self, name: str, part: str = "value") -> float | None:
        """``value``, ``spread``, ``low`` or ``high`` of a number; None if not published."""
        number = self.numbers.get(name)
        return None if number is None else getattr(number, part)


def read_thesis(path: str | Path) -> Thesis:
    """Read the published numbers.

    Raises:
        InputError: the file cannot be read, or a number is not valid; the message names it.
    """
    import yaml

    try:
        raw = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
        return Thesis.model_validate(raw)
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", file=path) from None
    except yaml.YAMLError as error:
        raise InputError(f"is not YAML ({error})", file=path) from None
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise InputError(first["msg"], file=path, place=place) from None
