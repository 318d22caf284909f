"""What ``scenenet.core.code_hash`` needs to know of a file of Python, remembered between processes.

To parse the whole package takes a second, and Snakemake needs it at every start. What a file
contains depends on its bytes alone, so it is kept under their digest, beside the bytecode.
"""

from __future__ import annotations

import ast
import contextlib
import hashlib
import json
import sys
from collections.abc import Iterator
from functools import cache
from importlib.util import cache_from_source
from pathlib import Path
from typing import Any, NamedTuple

from scenenet.core.errors import InputError
from scenenet.core.files import atomic, read_json, sha256

MOST_REMEMBERED = 2000
"""Files whose content is kept; those that were used the longest ago go first."""

_TYPE_CHECKING = frozenset({"TYPE_CHECKING", "typing.TYPE_CHECKING"})


class Import(NamedTuple):
    """A name that a file imports.

    Attributes:
        bound: name that the file knows it by.
        level: number of leading dots of a relative import.
        module: after the dots; may be empty.
        name: in the module; None if the whole module is imported, or all of its names.
    """

    bound: str
    level: int
    module: str
    name: str | None


class ParsedSource(NamedTuple):
    """A file of Python.

    Attributes:
        digest: of its syntax tree without docstrings.
        imports: every import that may run.
        only_imports: whether it only imports names, or lists them in ``__all__``.
    """

    digest: str
    imports: tuple[Import, ...]
    only_imports: bool


class SourceCache:
    """Parsed files by the digest of their bytes, in memory and in a file.

    The file is a help and no more: where it cannot be read or written, everything is parsed.
    """

    def __init__(self, path: Path | None) -> None:
        """``path`` is None to remember nothing between processes."""
        self.path = path
        self.changed = False
        self.made_by = sha256(__file__)
        self.known: dict[str, ParsedSource] = {}
        if path is not None:
            # A damaged file may hold any JSON.
            with contextlib.suppress(OSError, ValueError, TypeError, KeyError, AttributeError):
                self.known = _from_json(read_json(path), self.made_by)

    def read(self, file: Path) -> ParsedSource:
        """A file, parsed now or by an earlier process.

        Raises:
            InputError: the file is missing or is not Python.
        """
        try:
            content = file.read_bytes()
        except OSError as error:
            raise InputError(f"cannot be read ({error.strerror})", file=file) from None
        key = hashlib.sha256(content).hexdigest()
        found = self.known.pop(key, None)
        if found is None:
            self.changed = True
            found = _parse(content, file)
        self.known[key] = found  # at the end: the latest one
        return found

    def save(self) -> None:
        """Write what was parsed since the last time."""
        if self.path is None or not self.changed:
            return
        latest = list(self.known.items())[-MOST_REMEMBERED:]
        with contextlib.suppress(OSError, InputError), atomic(self.path) as partial:
            content = {"made_by": self.made_by, "sources": dict(latest)}
            partial.write_text(json.dumps(content), encoding="utf-8")
        self.changed = False


@cache
def source_cache() -> SourceCache:
    """The cache of this process, in the folder of the bytecode."""
    tag = sys.implementation.cache_tag
    if tag is None or sys.dont_write_bytecode:
        return SourceCache(None)
    return SourceCache(Path(cache_from_source(__file__)).with_suffix(".json"))


def _from_json(content: Any, made_by: str) -> dict[str, ParsedSource]:
    if content["made_by"] != made_by:
        return {}
    return {
        key: ParsedSource(digest, tuple(Import(*one) for one in imports), only)
        for key, (digest, imports, only) in content["sources"].items()
    }


def _parse(content: bytes, file: Path) -> ParsedSource:
    try:
        tree = ast.parse(content, filename=str(file))
    except SyntaxError as error:
        place = f"line {error.lineno}"
        raise InputError(
            f"the file is not valid Python ({error.msg})", file=file, place=place
        ) from None
    imports = tuple(_imports(tree))
    _strip_docstrings(tree)
    return ParsedSource(
        hashlib.sha256(ast.unparse(tree).encode()).hexdigest(),
        imports,
        all(_is_import(statement) for statement in tree.body),
    )


def _imports(tree: ast.AST) -> Iterator[Import]:
    for node in _executed(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield Import(alias.asname or alias.name, 0, alias.name, None)
        elif isinstance(node, ast.ImportFrom):
            for alias in node.names:
                name = None if alias.name == "*" else alias.name
                bound = alias.asname or alias.name
                yield Import(bound, node.level, node.module or "", name)


def _executed(node: ast.AST) -> Iterator[ast.AST]:
    """All statements below ``node`` except the bodies of ``if TYPE_CHECKING``."""
    for child in _statements(node):
        if isinstance(child, ast.If) and ast.unparse(child.test) in _TYPE_CHECKING:
            for statement in child.orelse:
                yield statement
                yield from _executed(statement)
            continue
        yield child
        yield from _executed(child)


def _statements(node: ast.AST) -> Iterator[ast.AST]:
    """The statements, handlers and cases directly below ``node``. Expressions contain none, and
    visiting them would take most of the time."""
    for part in ("body", "handlers", "orelse", "finalbody", "cases"):
        children = getattr(node, part, None)
        if isinstance(children, list):
            yield from children


def _is_import(statement: ast.stmt) -> bool:
    """Whether a statement of an ``__init__`` only imports names, or lists them in ``__all__``."""
    if isinstance(statement, ast.Assign):
        return [ast.unparse(target) for target in statement.targets] == ["__all__"]
    if isinstance(statement, ast.ImportFrom):
        return all(alias.name != "*" for alias in statement.names)
    return isinstance(statement, ast.Pass)


def _strip_docstrings(tree: ast.Module) -> None:
    """Remove strings that are statements of their own: docstrings of modules, classes, functions
    and attributes."""
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop()
        for part in ("body", "orelse", "finalbody"):
            statements = getattr(node, part, None)
            if isinstance(statements, list):
                kept = [s for s in statements if not _is_text(s)]
                # The body of a function must not be empty; other parts may be.
                empty = [ast.Pass()] if statements and part == "body" else []
                setattr(node, part, kept or empty)
        waiting += _statements(node)


def _is_text(statement: ast.stmt) -> bool:
    return (
        isinstance(statement, ast.Expr)
        and isinstance(statement.value, ast.Constant)
        and isinstance(statement.value.value, str)
    )
