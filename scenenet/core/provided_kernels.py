"""Kernels from outside the package, which users provide: found here by name, and not run.

A kernel is a file ``NAME.py``, or an entry point of the group ``scenenet.geneos`` of an installed
package. Names are known without running any of them and without torch, because settings are
checked against them. ``scenenet.geneo.outside`` runs the one that is used.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType

import scenenet
from scenenet.core.errors import InputError
from scenenet.core.files import sha256

VARIABLE = "SCENENET_KERNELS"
"""Environment variable with files and folders of kernels, separated as in PATH. It is the only
place where they are kept, so that the processes of the workflow know them as well."""

GROUP = "scenenet.geneos"
"""Group of the entry points. Each has the name of its kernel and refers to the class."""

LONGEST_NAME = 26
"""Letters of a kernel's name: a LAS dimension has 32, and ``share_NAME`` is one."""

_NOT_KERNELS = ("_", ".", "test_", "conftest")
"""How the names of files begin that a folder of kernels may hold besides."""


@dataclass(frozen=True)
class KernelSource:
    """Where the code of a kernel from outside the package is.

    Attributes:
        name: of the kernel.
        file: its Python file; None for an entry point, whose file is found when it is needed.
        entry: ``MODULE:CLASS`` of an entry point; None for a file.
        distribution, version: the installed package of an entry point; None for a file.
    """

    name: str
    file: Path | None = None
    entry: str | None = None
    distribution: str | None = None
    version: str | None = None

    @property
    def where(self) -> str:
        """What the user knows it by: a path, or a package with its version."""
        return str(self.file) if self.file else f"{self.distribution} {self.version}"

    @property
    def path(self) -> Path:
        """Its Python file.

        Raises:
            InputError: an entry point refers to no file.
        """
        return self.file or _file_of(self)

    @property
    def sha256(self) -> str:
        """Digest of its Python file; a process works with one state of it.

        Raises:
            InputError: the file cannot be read.
        """
        return _digest(self.path)

    def record(self) -> dict[str, str]:
        """What model files say about it: name of the file or of the package, and digest."""
        if self.file is not None:
            return {"file": self.file.name, "sha256": self.sha256}
        origin = {"distribution": self.distribution or "", "version": self.version or ""}
        return origin | {"sha256": self.sha256}


def built_in_kernels() -> frozenset[str]:
    """The names of the kernels of the package: those of their files."""
    files = Path(scenenet.__path__[0], "geneo", "kernels").glob("[!_]*.py")
    return frozenset(file.stem for file in files)


def known_kernels() -> set[str]:
    """The names of all kernels, built in and provided."""
    return {*built_in_kernels(), *provided()}


def provided() -> Mapping[str, tuple[KernelSource, ...]]:
    """The kernels from outside by name. A name with several sources is that of none of them.

    Raises:
        InputError: a file or folder in ``VARIABLE`` is missing, or the name of a file cannot be
            that of a kernel.
    """
    return _provided(os.environ.get(VARIABLE, ""))


def source_named(name: str) -> KernelSource | None:
    """Where the kernel called ``name`` is provided; None for a built-in kernel and an unknown one.

    Raises:
        InputError: there are several.
    """
    if name in built_in_kernels():
        return None
    found = provided().get(name, ())
    if len(found) > 1:
        raise _several(name, found)
    return found[0] if found else None


def source_of_file(path: str | Path) -> KernelSource:
    """The kernel in a file, whether it is provided or not.

    Raises:
        InputError: the file is missing, or cannot be a kernel.
    """
    if Path(path).is_dir():
        raise InputError("this is a folder, not a kernel file", file=path)
    return _of_file(_files(Path(path))[0])


def provide(paths: Iterable[str | Path] = ()) -> None:
    """Add files and folders to those in ``VARIABLE``, for this process and those it starts.

    Raises:
        InputError: a path is missing, a file cannot be a kernel, or its name is that of another
            kernel.
    """
    value = os.environ.get(VARIABLE, "")
    for path in paths:
        if os.pathsep in str(path):
            raise InputError(
                f"the path has a {os.pathsep!r}, which separates paths in {VARIABLE}",
                file=path,
                remedy="Rename it",
            )
    both = dict.fromkeys([*_paths(value), *(str(Path(path).absolute()) for path in paths)])
    wanted = os.pathsep.join(both)
    _provided.cache_clear()
    for error in faults(_provided(wanted)):
        raise error
    if both:
        os.environ[VARIABLE] = wanted


def faults(
    found: Mapping[str, tuple[KernelSource, ...]], *, packages: bool = False
) -> Iterator[InputError]:
    """Why some of the kernels in ``found`` cannot be used.

    Args:
        packages: include what only concerns installed packages, of which a user may use others.
    """
    for name, sources in found.items():
        files = [source for source in sources if source.file is not None]
        concerned = sources if packages else files
        if concerned and name in built_in_kernels():
            yield InputError(
                f"a kernel of the package is called {name!r} as well",
                file=concerned[0].where,
                remedy="Give the file and its kernel another name",
            )
        elif concerned and len(sources) > 1:
            yield _several(name, sources)


def name_fault(name: str) -> str | None:
    """Why ``name`` cannot be that of a kernel; None if it can."""
    if not re.fullmatch(r"[a-z][a-z0-9_]*", name):
        return "must have small letters, digits and underscores only, and begin with a letter"
    if re.search(r"_\d+$", name):
        return "must not end in a number, which distinguishes repeated kernels of a model"
    if len(name) > LONGEST_NAME:
        return f"must have at most {LONGEST_NAME} letters"
    if name.startswith(_NOT_KERNELS):
        return "must not begin like the name of a test"
    return None


def _several(name: str, sources: tuple[KernelSource, ...]) -> InputError:
    return InputError(
        f"{len(sources)} kernels are called {name!r}: {' and '.join(s.where for s in sources)}",
        remedy="Provide one of them only, or rename the others",
    )


def _paths(value: str) -> list[str]:
    return [part for part in value.split(os.pathsep) if part]


@cache
def _provided(value: str) -> Mapping[str, tuple[KernelSource, ...]]:
    found: dict[str, tuple[KernelSource, ...]] = {}
    files = dict.fromkeys(file for path in _paths(value) for file in _files(Path(path)))
    for source in [*map(_of_file, files), *_of_packages()]:
        found[source.name] = (*found.get(source.name, ()), source)
    return MappingProxyType(found)


def _files(path: Path) -> list[Path]:
    """The resolved file at ``path``, or those of the folder."""
    if path.is_dir():
        files = sorted(f for f in path.glob("*.py") if not f.name.startswith(_NOT_KERNELS))
        if not files:
            raise InputError(
                "the folder has no kernel file",
                file=path,
                remedy="Name a folder with .py files, or a file",
            )
        return [file.resolve() for file in files]
    if not path.is_file() or path.suffix != ".py":
        raise InputError(
            "there is no such kernel file" if not path.exists() else "not a Python file (.py)",
            file=path,
            remedy=f"Name a .py file or a folder of them with --kernels or in {VARIABLE}",
        )
    return [path.resolve()]


def _of_file(file: Path) -> KernelSource:
    if fault := name_fault(file.stem):
        raise InputError(
            f"a kernel has the name of its file, which {fault}",
            file=file,
            remedy="Rename the file, or move it elsewhere if it is no kernel",
        )
    return KernelSource(file.stem, file)


def _of_packages() -> list[KernelSource]:
    return [_of_entry(entry) for entry in entry_points(group=GROUP)]


def _of_entry(entry: EntryPoint) -> KernelSource:
    origin = entry.dist
    name, version = (origin.name, origin.version) if origin else ("an unnamed package", "")
    return KernelSource(entry.name, None, entry.value, name, version)


def _file_of(source: KernelSource) -> Path:
    """The file of the module of an entry point, found without running it."""
    module = (source.entry or "").partition(":")[0].strip()
    top, *rest = module.split(".")
    spec = find_spec(top) if top else None
    folders = [] if spec is None else list(spec.submodule_search_locations or [])
    if spec is not None and spec.origin and not rest:
        return Path(spec.origin)
    for folder in folders if rest else []:
        base = Path(folder, *rest)
        for file in (base.with_suffix(".py"), base / "__init__.py"):
            if file.is_file():
                return file
    raise InputError(
        f"its entry point {source.name!r} refers to {source.entry!r}, and there is no such Python "
        "file",
        file=source.where,
        remedy="Install the package again, or uninstall it",
    )


@cache
def _digest(path: Path) -> str:
    try:
        return sha256(path)
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", file=path) from None
