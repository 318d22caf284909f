"""Runs the code of a kernel or a measurement from outside the package.

Only what the user provides is run (``scenenet.core.provided_code``), and only when its name is
used. A model file makes no code run.
"""

from __future__ import annotations

import hashlib
import linecache
import sys
import traceback
from collections.abc import Callable
from contextvars import ContextVar
from importlib import import_module
from types import ModuleType
from typing import TypeVar

from scenenet.core.errors import InputError
from scenenet.core.provided_code import CodeSource

Provided = TypeVar("Provided")

REGISTERED: ContextVar[list[type] | None] = ContextVar("registered", default=None)
"""The classes that the code which is being run registers; None where none is being run."""


def run(
    source: CodeSource, base: type[Provided], fault_of: Callable[[Provided], str | None]
) -> Provided:
    """What ``source`` provides; its code is run.

    Args:
        base: what its class must be a subclass of.
        fault_of: why an instance cannot be used, as the end of a sentence that begins with its
            name; None if it can.

    Raises:
        InputError: the code fails, registers no class of this name, or has a fault; names the file
            and the line.
    """
    path, kind = source.path, source.kind
    found: list[type] = []
    token = REGISTERED.set(found)
    try:
        instance = _of_file(source, found, base) if source.file else _of_entry(source, base)
        fault = fault_of(instance)
    except InputError:
        raise
    except (Exception, SystemExit) as error:
        raise _failed(source, error) from error
    finally:
        REGISTERED.reset(token)
    if fault is not None:
        raise InputError(
            f"the {kind.noun} {source.name!r} {fault}",
            file=path,
            remedy=f"Correct the {kind.noun} file",
        )
    return instance


def _of_file(source: CodeSource, found: list[type], base: type[Provided]) -> Provided:
    path, noun = source.path, source.kind.noun
    content = path.read_bytes()
    if hashlib.sha256(content).hexdigest() != source.sha256:
        raise InputError("the file was changed while the command ran", file=path, remedy="Repeat")
    module = ModuleType(f"{source.kind.group}.outside.{source.name}")
    module.__file__ = str(path)
    linecache.checkcache(str(path))
    sys.modules[module.__name__] = module
    try:
        exec(compile(content, str(path), "exec"), module.__dict__)
    except BaseException:
        del sys.modules[module.__name__]
        raise
    names = [getattr(registered, "name", "without a name") for registered in found]
    if not found or not issubclass(found[0], base):
        raise InputError(
            f"the file registers no {noun}",
            file=path,
            remedy=f"Decorate its subclass of {source.kind.base} with @register",
        )
    if names != [source.name]:
        raise InputError(
            f"the file registers {', '.join(map(repr, names))}, and a {noun} has the name of its "
            f"file, here {source.name!r}",
            file=path,
            remedy=f"Write each {noun} into a file of its own name",
        )
    instance: Provided = found[0]()
    return instance


def _of_entry(source: CodeSource, base: type[Provided]) -> Provided:
    module, _, name = (part.strip() for part in (source.entry or "").partition(":"))
    found = getattr(import_module(module), name, None) if name else None
    if not (isinstance(found, type) and issubclass(found, base)):
        raise InputError(
            f"its entry point {source.name!r} must refer to a subclass of {source.kind.base} as "
            f"MODULE:CLASS, and refers to {source.entry!r}",
            file=source.where,
            remedy="Correct the entry point in the package",
        )
    own = getattr(found, "name", None)
    if own != source.name:
        raise InputError(
            f"its entry point {source.name!r} refers to a {source.kind.noun} called {own!r}",
            file=source.where,
            remedy=f"Give the entry point the name of the {source.kind.noun}",
        )
    instance: Provided = found()
    return instance


def _failed(source: CodeSource, error: BaseException) -> InputError:
    """What is wrong with code that raised ``error``, and in which line of its file."""
    path = source.path
    lines = [f.lineno for f in traceback.extract_tb(error.__traceback__) if f.filename == str(path)]
    line = error.lineno if isinstance(error, SyntaxError) else (lines[-1] if lines else None)
    text = error.msg if isinstance(error, SyntaxError) else str(error)
    return InputError(
        f"the {source.kind.noun} file fails with {type(error).__name__}: {text}".rstrip(": "),
        file=path,
        place=None if line is None else f"line {line}",
        remedy="Correct the file",
    )
