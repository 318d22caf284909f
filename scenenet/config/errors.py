"""Messages about wrong settings, with a correct line to copy."""

from __future__ import annotations

import difflib
from typing import Any, get_args

import yaml
from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails, PydanticUndefined, to_jsonable_python

Place = tuple[int | str, ...]


def explain(error: ValidationError, model: type[BaseModel]) -> str:
    """One paragraph per wrong setting: its key, the problem, and an example line.

    Args:
        error: of pydantic.
        model: the settings model, to look up names, defaults and descriptions.
    """
    details = error.errors()
    wrong = {item["loc"] for item in details}
    own = [item for item in details if not _follows(item["loc"], wrong)]
    count = "one setting is wrong" if len(own) == 1 else f"{len(own)} settings are wrong"
    return "\n".join([count, *(_paragraph(item, model) for item in own)])


def _follows(place: Place, wrong: set[Place]) -> bool:
    """Whether an error only repeats another: a list counts as too short if one of its entries is
    wrong, and the common training settings are copied into each model."""
    copied = place[:1] == ("models",) and place[2:3] == ("training",) and place[2:] in wrong
    return copied or any(
        len(other) > len(place) and other[: len(place)] == place for other in wrong
    )


def _paragraph(item: ErrorDetails, model: type[BaseModel]) -> str:
    place = item["loc"]
    key = _dotted(place)
    if item["type"] == "extra_forbidden":
        known = list(_fields(model, place[:-1]))
        close = difflib.get_close_matches(str(place[-1]), known, n=1, cutoff=0.5)
        if not close:
            return f"  {key}: there is no such setting. Settings: {_known(model, place[:-1])}"
        right = (*place[:-1], close[0])
        return f"  {key}: there is no such setting. Did you mean {close[0]!r}? Write\n" + _snippet(
            right, item["input"]
        )
    if item["type"] == "missing":
        return f"  {key}: is missing{_meaning(model, place)}"
    message = item["msg"].removeprefix("Value error, ")
    if item["type"] == "value_error":
        return f"  {key}: {message}" if key else f"  {message}"
    given = repr(item["input"])
    if item["type"] == "model_type":
        return f"  {key}: is {given}, but groups the settings {_known(model, place)}"
    problem = f"  {key}: {given} is not allowed: {_lower(message)}{_meaning(model, place)}"
    default = _default(model, place)
    if default is PydanticUndefined or isinstance(place[-1], int):
        return problem
    return f"{problem}. Write for example\n{_snippet(place, default)}"


def _dotted(place: Place) -> str:
    """models.0.name -> models[0].name"""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in place)
    return text.removeprefix(".")


def _snippet(place: Place, value: Any) -> str:
    """The setting as lines of a YAML file; for an entry of a list, the entry alone."""
    first = max((i + 1 for i, part in enumerate(place) if isinstance(part, int)), default=0)
    *groups, key = place[first:]
    lines = [f"{'  ' * depth}{group}:" for depth, group in enumerate(groups)]
    text = yaml.safe_dump(value, default_flow_style=True, width=1000).splitlines()[0]
    lines.append(f"{'  ' * len(groups)}{key}: {text}")
    return "\n".join(f"      {line}" for line in lines)


def _meaning(model: type[BaseModel], place: Place) -> str:
    """Description of the setting at ``place``, in brackets."""
    field = _field(model, place)
    return f" ({field.description})" if field is not None and field.description else ""


def _default(model: type[BaseModel], place: Place) -> Any:
    field = _field(model, place)
    default = PydanticUndefined if field is None else field.get_default(call_default_factory=True)
    return default if default is PydanticUndefined else to_jsonable_python(default)


def _field(model: type[BaseModel], place: Place) -> Any:
    """The field at ``place``, or the field that contains it; None if there is none."""
    while place and isinstance(place[-1], int):
        place = place[:-1]
    return _fields(model, place[:-1]).get(str(place[-1])) if place else None


def _fields(model: type[BaseModel], place: Place) -> dict[str, Any]:
    """Name -> field of the model at ``place``; empty if there is no model."""
    inside: type[BaseModel] | None = model
    for part in place:
        if isinstance(part, int):
            continue
        field = inside.model_fields.get(part) if inside is not None else None
        inside = None if field is None else model_in(field.annotation)
    return {} if inside is None else dict(inside.model_fields)


def model_in(annotation: Any) -> type[BaseModel] | None:
    """The settings model in an annotation such as ``tuple[Model, ...]`` or ``Model | None``."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    found = (model_in(inner) for inner in get_args(annotation))
    return next((inner for inner in found if inner is not None), None)


def _known(model: type[BaseModel], place: Place) -> str:
    return ", ".join(_fields(model, place))


def _lower(message: str) -> str:
    return message[:1].lower() + message[1:]
