"""Class schemes: what the class codes of a survey mean.

Three schemes are known: ``edp`` (thesis Table 5.1), ``asprs`` (LAS 1.4, Table 17) and ``ts40k``
(the six merged classes of the ``.pt`` samples that the TS40K dataset's own tools write). Code 15 is
a transmission tower in the first two, but most other codes differ: a conductor is 16 in ``edp`` and
14 in ``asprs``. In ``ts40k`` a tower is 4, which is vegetation in the other two. The user therefore
names the scheme; it is never guessed.

``SCHEMES`` is the only place that lists schemes. The settings, the choices of the command line, the
pictures, the codes of synthetic surveys and the table in the documentation follow from it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from scenenet.core.errors import InputError

Role = Literal[
    "tower", "conductor", "fitting", "vegetation", "ground", "building", "noise", "other"
]
"""What a class is to the method. ``fitting`` are insulators, and cables that are not conductors;
``ground`` includes surfaces on it; ``noise`` are the points that the producer marked as noise."""

Look = Literal["ground", "low", "tall", "stray", "other", "conductor", "tower"]
"""What a point looks like in a crop: ``low`` and ``tall`` are vegetation and objects by height."""

LOOK_COLOURS: Mapping[Look, str] = MappingProxyType(
    {
        "ground": "#A98B6D",
        "low": "#A6C36F",
        "tall": "#2F7D4F",
        "stray": "#CC79A7",
        "other": "#B5BAC1",
        "conductor": "#E69F00",
        "tower": "#D62728",
    }
)
"""Colour of each look in pictures that show low and tall objects apart; later ones are drawn over
earlier ones."""

ROLE_COLOURS: Mapping[Role, str] = MappingProxyType(
    {
        "tower": LOOK_COLOURS["tower"],
        "conductor": LOOK_COLOURS["conductor"],
        "vegetation": "#4C9A52",
        "ground": LOOK_COLOURS["ground"],
        "other": LOOK_COLOURS["other"],
    }
)
"""Colour of each role in all other pictures, the most important role first."""

_LOOK_OF_ROLE: Mapping[Role, Look] = MappingProxyType(
    {"vegetation": "tall", "noise": "stray", "building": "other", "fitting": "other"}
)
_ROLE_OF_LOOK: Mapping[Look, Role] = MappingProxyType(
    {"low": "vegetation", "tall": "vegetation", "ground": "ground"}
)


class ClassCode(NamedTuple):
    """One class of a scheme.

    Attributes:
        code: the number in the file.
        name: the name that the scheme gives the class.
        role: what the class is to the method.
        look: what points of this class look like, where this does not follow from the role. For
            ``edp`` it is how the public TS40K crops use the code (docs: synthetic surveys).
        main: whether points that are found to have the role get this code, where several classes
            have it.
    """

    code: int
    name: str
    role: Role = "other"
    look: Look | None = None
    main: bool = False

    @property
    def drawn_look(self) -> Look:
        """The look, or the one that follows from the role."""
        if self.look is not None:
            return self.look
        return _LOOK_OF_ROLE.get(self.role) or self.role  # type: ignore[return-value]

    @property
    def drawn_role(self) -> Role:
        """The role if it has a colour of its own, else the one that follows from the look."""
        if self.role in ROLE_COLOURS and self.role != "other":
            return self.role
        return _ROLE_OF_LOOK.get(self.drawn_look, "other")


@dataclass(frozen=True)
class ClassScheme:
    """A list of class codes.

    Attributes:
        name: the name in the survey sheet and on the command line.
        description: which surveys use the scheme.
        codes: its classes, by code.
    """

    name: str
    description: str
    codes: tuple[ClassCode, ...]

    @cached_property
    def classes(self) -> Mapping[int, str]:
        """Code -> name of the class."""
        return {entry.code: entry.name for entry in self.codes}

    @cached_property
    def tower(self) -> frozenset[int]:
        """Codes of power-line support towers."""
        return self.with_role("tower")

    def with_role(self, role: Role) -> frozenset[int]:
        """Codes of all classes with ``role``."""
        return frozenset(entry.code for entry in self.codes if entry.role == role)

    def main_code(self, role: Role) -> int:
        """The code that points get that are found to have ``role``."""
        entries = [entry for entry in self.codes if entry.role == role]
        return max(entries, key=lambda entry: entry.main).code

    def class_name(self, code: int) -> str:
        """The name of a code; "undefined (77)" for one that the scheme does not list."""
        return self.classes.get(int(code), f"undefined ({int(code)})")

    def code_of(self, name: str) -> int:
        """The code of the class called ``name``.

        Raises:
            KeyError: the scheme has no such class.
        """
        return {entry.name: entry.code for entry in self.codes}[name]

    def is_ground(self, classification: np.ndarray) -> np.ndarray:
        """(N,) bool: the points that look like bare ground, from their class codes (N,)."""
        ground = [entry.code for entry in self.codes if entry.drawn_look == "ground"]
        return np.isin(classification, ground)

    def roles(self, classification: np.ndarray) -> np.ndarray:
        """(N,) keys of ``ROLE_COLOURS``, from class codes (N,) uint8."""
        return _lookup({c.code: c.drawn_role for c in self.codes}, classification)

    def looks(self, classification: np.ndarray) -> np.ndarray:
        """(N,) keys of ``LOOK_COLOURS``, from class codes (N,) uint8."""
        return _lookup({c.code: c.drawn_look for c in self.codes}, classification)


def _lookup(names: Mapping[int, str], classification: np.ndarray) -> np.ndarray:
    return np.array([names.get(code, "other") for code in range(256)])[classification]


EDP = ClassScheme(
    "edp",
    "surveys of EDP and the public TS40K `.npy` crops (thesis Table 5.1)",
    (
        ClassCode(0, "Created"),
        ClassCode(1, "Unclassified"),
        ClassCode(2, "Ground", "ground"),
        ClassCode(3, "Low vegetation", "vegetation", "low"),
        ClassCode(4, "Medium vegetation", "vegetation", "low"),
        ClassCode(5, "Natural obstacle", "vegetation", "tall"),
        ClassCode(6, "Human structures", "building"),
        ClassCode(7, "Low point", "noise"),
        ClassCode(8, "Model keypoints"),
        ClassCode(9, "Water", "other", "ground"),
        ClassCode(10, "Rail", "ground"),
        ClassCode(11, "Road surface", "ground", "low"),
        ClassCode(12, "Overlap points", "other", "tall"),
        ClassCode(13, "Medium reliability"),
        ClassCode(14, "Low reliability"),
        ClassCode(15, "Power line support tower", "tower"),
        ClassCode(16, "Main power line", "conductor", main=True),
        ClassCode(17, "Other power line", "conductor"),
        ClassCode(18, "Fiber optic cable", "fitting"),
        ClassCode(19, "Not rated object to be considered", "other", "ground"),
        ClassCode(20, "Not rated object to be ignored"),
        ClassCode(21, "Incidents"),
    ),
)

ASPRS = ClassScheme(
    "asprs",
    "surveys that follow the LAS 1.4 standard",
    (
        ClassCode(0, "Created, never classified"),
        ClassCode(1, "Unclassified"),
        ClassCode(2, "Ground", "ground"),
        ClassCode(3, "Low vegetation", "vegetation"),
        ClassCode(4, "Medium vegetation", "vegetation"),
        ClassCode(5, "High vegetation", "vegetation"),
        ClassCode(6, "Building", "building"),
        ClassCode(7, "Low point (noise)", "noise"),
        ClassCode(8, "Model keypoint"),
        ClassCode(9, "Water"),
        ClassCode(10, "Rail"),
        ClassCode(11, "Road surface", "ground"),
        ClassCode(12, "Overlap points"),
        ClassCode(13, "Wire - guard (shield)", "conductor"),
        ClassCode(14, "Wire - conductor (phase)", "conductor", main=True),
        ClassCode(15, "Transmission tower", "tower"),
        ClassCode(16, "Wire-structure connector (insulator)", "fitting"),
        ClassCode(17, "Bridge deck"),
        ClassCode(18, "High noise", "noise"),
        ClassCode(19, "Overhead structure"),
        ClassCode(20, "Ignored ground"),
        ClassCode(21, "Snow"),
        ClassCode(22, "Temporal exclusion"),
    ),
)

TS40K = ClassScheme(
    "ts40k",
    "`.pt` samples written by the tools of TS40K, which merge the 22 codes into six",
    (
        ClassCode(0, "Noise", "noise"),
        ClassCode(1, "Ground", "ground"),
        ClassCode(2, "Low vegetation", "vegetation"),
        ClassCode(3, "Medium vegetation and obstacles", "vegetation"),
        ClassCode(4, "Power line support tower", "tower"),
        ClassCode(5, "Power lines", "conductor"),
    ),
)

SCHEMES: Mapping[str, ClassScheme] = MappingProxyType(
    {scheme.name: scheme for scheme in (EDP, ASPRS, TS40K)}
)
"""Every scheme by its name; a new one is added here and nowhere else."""

if TYPE_CHECKING:
    Codes = str
else:
    Codes = Literal[tuple(SCHEMES)]
    """The names of ``SCHEMES``, as settings take them."""


def class_scheme(name: str) -> ClassScheme:
    """The scheme called ``name``.

    Raises:
        InputError: there is no such scheme; the message lists the known ones.
    """
    try:
        return SCHEMES[name]
    except KeyError:
        raise InputError(
            f"unknown class scheme {name!r}",
            remedy=f"Choose one of: {', '.join(SCHEMES)} ({difference()})",
        ) from None


MISFIT_FACTOR = 20
"""A scheme is doubted if another one finds this many times as many conductor points."""


def misfit(scheme: ClassScheme, counts: np.ndarray) -> str | None:
    """Why the codes of a survey look like those of another scheme, as a sentence; else None.

    Schemes with the same code for towers differ in the codes of conductors, and a labelled survey
    with towers has conductors.

    Args:
        scheme: the scheme that the user named.
        counts: (256,) points of each code.
    """
    own = int(counts[list(scheme.with_role("conductor"))].sum())
    for other in SCHEMES.values():
        if other is scheme or other.tower != scheme.tower:
            continue
        conductors = other.with_role("conductor")
        if counts[list(conductors)].sum() < MISFIT_FACTOR * (own + 1):
            continue
        code = max(conductors, key=lambda code: counts[code])
        return (
            f"the class codes look like those of scheme {other.name}, not {scheme.name}: code "
            f"{code} ({counts[code]} points) is {other.class_name(code)!r} in {other.name} but "
            f"{scheme.class_name(code)!r} in {scheme.name}, where conductors have the code "
            f"{_listed(scheme.with_role('conductor'))} ({own} points)"
        )
    return None


def difference() -> str:
    """How the schemes differ, in one line: the codes of towers and conductors in each."""
    return "; ".join(
        f"{name}: tower {_listed(scheme.tower)}, conductor {_listed(scheme.with_role('conductor'))}"
        for name, scheme in SCHEMES.items()
    )


def markdown() -> str:
    """The schemes as a Markdown table, for the documentation."""
    rows = [
        f"| `{name}` | {_listed(scheme.tower)} | {_listed(scheme.with_role('conductor'))} "
        f"| {_listed(scheme.with_role('ground'))} | {scheme.description} |"
        for name, scheme in SCHEMES.items()
    ]
    head = ["| scheme | tower | conductors | ground | use it for |", "|---|---|---|---|---|"]
    return "\n".join([*head, *rows])


def _listed(codes: Iterable[int]) -> str:
    return ", ".join(map(str, sorted(codes)))
