"""A digest of the code behind a script; it changes only if the result could change.

Snakemake compares the date of a script and ignores what it imports. This digest covers everything
in the package that a script uses, by content, and ignores comments, docstrings and layout.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cache
from importlib.util import find_spec, resolve_name
from pathlib import Path

from scenenet.core.files import digest, sha256
from scenenet.core.parsed_source import ParsedSource, source_cache

Use = tuple[str, str | None]
"""A module and the name that is used from it; None if the whole module is used."""

_COMPILED = frozenset({".py", ".pyc", ".pyo", ".so", ".nbc", ".nbi"})


def code_hash(entry_files: Iterable[str | Path], package: str = "scenenet") -> str:
    """Digest of some scripts and of all code of ``package`` that they use, directly or indirectly.

    - Imports inside functions count like those at the top; those under ``if TYPE_CHECKING`` do
      not, because they never run. Scripts in the same folder that a script imports count too.
    - A module counts by its syntax tree, without docstrings.
    - An ``__init__`` that only imports names is transparent: code that imports one of its names
      uses the module that the name comes from, and not the others.
    - The files of a package that are not code, such as templates, count for each of its modules.
    - A module that finds others with ``pkgutil`` counts all code in its folder and below.
    - Other libraries do not count.

    Raises:
        InputError: a file is missing or is not Python.
    """
    used = sorted(used_code(entry_files, package))
    source_cache().save()
    return digest([[name, content] for name, content in used])


def used_code(entry_files: Iterable[str | Path], package: str = "scenenet") -> set[tuple[str, str]]:
    """(name, digest) of every script, module and data file that ``code_hash`` covers."""
    used: set[tuple[str, str]] = set()
    waiting: list[Use] = []
    for file in _scripts(entry_files, package):
        source = _read(file, None, package)
        used.add((file.name, source.digest))
        waiting += source.uses
    done: set[Use] = set()
    while waiting:
        use = waiting.pop()
        if use in done:
            continue
        done.add(use)
        parts, more = _resolve(use, package)
        used |= parts
        waiting += more
    return used


def _scripts(entry_files: Iterable[str | Path], package: str) -> set[Path]:
    """The entry files and the scripts in their folders that they import."""
    found: set[Path] = set()
    waiting = [Path(entry).resolve() for entry in entry_files]
    while waiting:
        file = waiting.pop()
        if file not in found:
            found.add(file)
            waiting += _read(file, None, package).neighbours
    return found


def _resolve(use: Use, package: str) -> tuple[set[tuple[str, str]], list[Use]]:
    """(name, digest) of what the use of a name adds, and what this uses in turn."""
    module, name = use
    file = _locate(module)
    if file is None:
        return set(), []
    source = _read(file, module, package)
    # Importing a.b.c runs a and a.b first, which matters if they do more than import names.
    parent = module.rpartition(".")[0]
    more: list[Use] = []
    if parent and not _source_of(parent, package).only_imports:
        more.append((parent, None))
    if name is not None:
        if _locate(f"{module}.{name}") is not None:
            more.append((f"{module}.{name}", None))
            if source.only_imports:
                return set(), more
        elif source.only_imports and name in source.exports:
            return set(), [*more, source.exports[name]]
    holder = file.parent
    data = {(f"{holder.name}/{p.relative_to(holder)}", sha256(p)) for p in _data_files(holder)}
    return {(module, source.digest)} | data, [*more, *source.uses]


@dataclass(frozen=True)
class _Source:
    """One file of Python.

    Attributes:
        digest: of its syntax tree without docstrings.
        uses: what it imports of the package.
        only_imports: whether it is an ``__init__`` that only imports names.
        exports: name -> where it comes from, in such an ``__init__``.
        neighbours: for a script, the scripts in its folder that it imports.
    """

    digest: str
    uses: tuple[Use, ...]
    only_imports: bool = False
    exports: dict[str, Use] = field(default_factory=dict)
    neighbours: tuple[Path, ...] = ()


def _source_of(module: str, package: str) -> _Source:
    file = _locate(module)
    return _Source("", (), True) if file is None else _read(file, module, package)


@cache
def _locate(name: str) -> Path | None:
    """File of a module, found by importing only the top-level package."""
    top, _, rest = name.partition(".")
    spec = find_spec(top)
    if spec is None or spec.origin is None:
        return None
    root = Path(spec.origin).parent
    base = root.joinpath(*rest.split(".")) if rest else root
    if (base / "__init__.py").is_file():
        return base / "__init__.py"
    file = base.with_suffix(".py")
    return file if rest and file.is_file() else None


@cache
def _read(file: Path, name: str | None, package: str) -> _Source:
    """A file; ``name`` is None for a script outside the package.

    Cached: a process works with one state of the code, as it does for its imports.
    """
    parsed = source_cache().read(file)
    is_package = file.name == "__init__.py"
    inside = name if is_package else (name or "").rpartition(".")[0]
    imports = list(_absolute(parsed, inside or ""))
    tops = {module for _, module, _ in imports}
    uses = {(module, used) for _, module, used in imports if _within(module, package)}
    if name is not None and "pkgutil" in {module.partition(".")[0] for module in tops}:
        uses |= _all_modules(file.parent, inside or "")
    neighbours = [file.with_name(f"{module}.py") for module in sorted(tops)] if name is None else []
    return _Source(
        parsed.digest,
        tuple(sorted(uses, key=str)),
        is_package and parsed.only_imports,
        {bound: (module, used) for bound, module, used in imports if _within(module, package)},
        tuple(script for script in neighbours if script.is_file()),
    )


def _within(module: str, package: str) -> bool:
    return module == package or module.startswith(f"{package}.")


def _absolute(parsed: ParsedSource, inside: str) -> Iterator[tuple[str, str, str | None]]:
    """(bound name, module, name in the module) of every import that may run.

    ``inside`` is the package that relative imports start from.
    """
    for one in parsed.imports:
        if one.level and not inside:
            continue  # a script has no package; Python would refuse this import too
        source = "." * one.level + one.module
        yield one.bound, resolve_name(source, inside) if one.level else source, one.name


def _all_modules(folder: Path, name: str) -> set[Use]:
    files = folder.rglob("*.py")
    parts = (file.relative_to(folder).with_suffix("").parts for file in files)
    return {(".".join([name, *(p for p in path if p != "__init__")]), None) for path in parts}


@cache
def _data_files(folder: Path) -> tuple[Path, ...]:
    """Files of a package that are not code: its own, and those of subfolders without Python
    files."""
    found: list[Path] = []
    for path in sorted(folder.iterdir()):
        if path.name.startswith((".", "__pycache__")):
            continue
        if path.is_dir():
            if not any(path.glob("*.py")):
                found += _data_files(path)
        elif path.suffix not in _COMPILED:
            found.append(path)
    return tuple(found)
