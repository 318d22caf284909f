"""Kernels and measurements from outside the package, which users provide: found here by name, and
not run.

Each is a file ``NAME.py``, or an entry point of an installed package. Names are known without
running any of them and without torch, because settings are checked against them.
``scenenet.core.running_code`` runs the one that is used.
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

_OTHER_FILES = ("_", ".", "test_", "conftest")
"""How the names of files begin that a folder of provided files may hold besides."""


@dataclass(frozen=True)
class CodeSource:
    """Where provided code is.

    Attributes:
        kind: what it provides.
        name: of the kernel or measurement.
        file: its Python file; None for an entry point, whose file is found when it is needed.
        entry: ``MODULE:CLASS`` of an entry point; None for a file.
        distribution, version: the installed package of an entry point; None for a file.
    """

    kind: Provision
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


@dataclass(frozen=True)
class Provision:
    """A kind of code that users provide.

    Attributes:
        noun: what messages call one of them.
        base: the class that each of them is a subclass of, by name.
        option: of the command line, with the files.
        variable: environment variable with files and folders, separated as in PATH. It is the only
            place where they are kept, so that the processes of the workflow know them as well.
        group: of the entry points. Each has the name of what it provides and refers to the class.
        built_in_folder: parts of the path of the folder in the package whose files are built in.
        longest: letters of a name.
    """

    noun: str
    base: str
    option: str
    variable: str
    group: str
    built_in_folder: tuple[str, str]
    longest: int

    def built_in(self) -> frozenset[str]:
        """The names of those of the package, which are the names of their files."""
        return _built_in(self)

    def known(self) -> set[str]:
        """The names of all, built in and provided."""
        return {*self.built_in(), *self.provided()}

    def provided(self) -> Mapping[str, tuple[CodeSource, ...]]:
        """Those from outside by name. A name with several sources is that of none of them.

        Raises:
            InputError: a file or folder in ``variable`` is missing, or the name of a file is not
                allowed.
        """
        return _provided(self, os.environ.get(self.variable, ""))

    def source_named(self, name: str) -> CodeSource | None:
        """Where the one called ``name`` is provided; None for a built-in and an unknown one.

        Raises:
            InputError: there are several.
        """
        if name in self.built_in():
            return None
        found = self.provided().get(name, ())
        if len(found) > 1:
            raise self._several(name, found)
        return found[0] if found else None

    def source_of_file(self, path: str | Path) -> CodeSource:
        """What is in a file, whether it is provided or not.

        Raises:
            InputError: the file is missing, or cannot be one of this kind.
        """
        if Path(path).is_dir():
            raise InputError(f"this is a folder, not a {self.noun} file", file=path)
        return self._of_file(self._files(Path(path))[0])

    def provide(self, paths: Iterable[str | Path] = ()) -> None:
        """Add files and folders to those in ``variable``, for this process and those it starts.

        Raises:
            InputError: a path is missing, a file cannot be one of this kind, or its name is that
                of another one.
        """
        value = os.environ.get(self.variable, "")
        for path in paths:
            if os.pathsep in str(path):
                raise InputError(
                    f"the path has a {os.pathsep!r}, which separates paths in {self.variable}",
                    file=path,
                    remedy="Rename it",
                )
        both = dict.fromkeys([*_paths(value), *(str(Path(path).absolute()) for path in paths)])
        wanted = os.pathsep.join(both)
        _provided.cache_clear()
        for error in self.faults(_provided(self, wanted)):
            raise error
        if both:
            os.environ[self.variable] = wanted

    def faults(
        self, found: Mapping[str, tuple[CodeSource, ...]], *, packages: bool = False
    ) -> Iterator[InputError]:
        """Why some of ``found`` cannot be used.

        Args:
            packages: include what only concerns installed packages, of which a user may use others.
        """
        for name, sources in found.items():
            files = [source for source in sources if source.file is not None]
            concerned = sources if packages else files
            if concerned and name in self.built_in():
                yield InputError(
                    f"a {self.noun} of the package is called {name!r} as well",
                    file=concerned[0].where,
                    remedy=f"Give the file and its {self.noun} another name",
                )
            elif concerned and len(sources) > 1:
                yield self._several(name, sources)

    def name_fault(self, name: str) -> str | None:
        """Why ``name`` cannot be that of one of this kind; None if it can."""
        if not re.fullmatch(r"[a-z][a-z0-9_]*", name):
            return "must have small letters, digits and underscores only, and begin with a letter"
        if re.search(r"_\d+$", name):
            return f"must not end in a number, which distinguishes repeated {self.noun}s of a model"
        if len(name) > self.longest:
            return f"must have at most {self.longest} letters"
        if name.startswith(_OTHER_FILES):
            return "must not begin like the name of a test"
        return None

    def _several(self, name: str, sources: tuple[CodeSource, ...]) -> InputError:
        where = " and ".join(source.where for source in sources)
        return InputError(
            f"{len(sources)} {self.noun}s are called {name!r}: {where}",
            remedy="Provide one of them only, or rename the others",
        )

    def _files(self, path: Path) -> list[Path]:
        """The resolved file at ``path``, or those of the folder."""
        if path.is_dir():
            files = sorted(f for f in path.glob("*.py") if not f.name.startswith(_OTHER_FILES))
            if not files:
                raise InputError(
                    f"the folder has no {self.noun} file",
                    file=path,
                    remedy="Name a folder with .py files, or a file",
                )
            return [file.resolve() for file in files]
        if not path.is_file() or path.suffix != ".py":
            raise InputError(
                f"there is no such {self.noun} file"
                if not path.exists()
                else "not a Python file (.py)",
                file=path,
                remedy=f"Name a .py file or a folder of them with {self.option} or in "
                f"{self.variable}",
            )
        return [path.resolve()]

    def _of_file(self, file: Path) -> CodeSource:
        if fault := self.name_fault(file.stem):
            raise InputError(
                f"a {self.noun} has the name of its file, which {fault}",
                file=file,
                remedy=f"Rename the file, or move it elsewhere if it is no {self.noun}",
            )
        return CodeSource(self, file.stem, file)

    def _of_entry(self, entry: EntryPoint) -> CodeSource:
        origin = entry.dist
        name, version = (origin.name, origin.version) if origin else ("an unnamed package", "")
        return CodeSource(self, entry.name, None, entry.value, name, version)


KERNELS = Provision(
    noun="kernel",
    base="GeneoKernel",
    option="--kernels",
    variable="SCENENET_KERNELS",
    group="scenenet.geneos",
    built_in_folder=("geneo", "kernels"),
    longest=26,  # a LAS dimension has 32 letters, and ``share_NAME`` is one
)

MEASUREMENTS = Provision(
    noun="measurement",
    base="Measurement",
    option="--measurements",
    variable="SCENENET_MEASUREMENTS",
    group="scenenet.measurements",
    built_in_folder=("measurement", "kinds"),
    longest=26,
)


def _paths(value: str) -> list[str]:
    return [part for part in value.split(os.pathsep) if part]


@cache
def _built_in(kind: Provision) -> frozenset[str]:
    files = Path(scenenet.__path__[0], *kind.built_in_folder).glob("[!_]*.py")
    return frozenset(file.stem for file in files)


@cache
def _provided(kind: Provision, value: str) -> Mapping[str, tuple[CodeSource, ...]]:
    found: dict[str, tuple[CodeSource, ...]] = {}
    files = dict.fromkeys(file for path in _paths(value) for file in kind._files(Path(path)))
    packaged = map(kind._of_entry, entry_points(group=kind.group))
    for source in [*map(kind._of_file, files), *packaged]:
        found[source.name] = (*found.get(source.name, ()), source)
    return MappingProxyType(found)


def _file_of(source: CodeSource) -> Path:
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
