"""Settings as they are written in a configuration file, before they are validated."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def merged(base: Mapping[str, Any], over: Any) -> Any:
    """``base`` overridden by ``over``: mappings are merged key by key, other values replaced."""
    if not isinstance(over, Mapping):
        return over
    both = dict(base)
    for key, value in over.items():
        inner = both.get(key)
        both[key] = merged(inner, value) if isinstance(inner, Mapping) else value
    return both


def with_values(study: Any, values: Mapping[str, Any]) -> Any:
    """A study, or a variant of one, as it was written, with other values for what it changes."""
    if not isinstance(study, Mapping):
        return study
    replaced = dict(study)
    for part in ("common", "changes"):
        if isinstance(changes := study.get(part), Mapping):
            replaced[part] = {name: values.get(name, value) for name, value in changes.items()}
    if isinstance(variants := study.get("variants"), list | tuple):
        replaced["variants"] = [with_values(variant, values) for variant in variants]
    return replaced


def geneos_in(settings: Any) -> set[str]:
    """The names of kernels anywhere in settings, also in the changes of studies by dotted name."""
    if isinstance(settings, list | tuple):
        return set().union(*map(geneos_in, settings))
    if not isinstance(settings, Mapping):
        return set()
    found: set[str] = set()
    for key, value in settings.items():
        named = str(key).rpartition(".")[2] == "geneos"
        found |= _texts(value) if named else geneos_in(value)
    return found


def _texts(value: Any) -> set[str]:
    if isinstance(value, list | tuple):
        return set().union(*map(_texts, value))
    return {value} if isinstance(value, str) else set()
