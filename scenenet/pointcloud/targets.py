"""Targets: what an observer finds, as a name and class codes.

The names of ``ROLES`` mean the classes of a role in each class scheme, so that an observer that was
trained on surveys of one scheme can be scored on surveys of another one. A target with codes of its
own means these codes, in the scheme of the surveys that it was trained on.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from scenenet.core.errors import InputError
from scenenet.pointcloud.class_schemes import SCHEMES, ClassScheme, Role

ROLES: Mapping[str, Role] = MappingProxyType(
    {"tower": "tower", "wire": "conductor", "vegetation": "vegetation", "ground": "ground"}
)
"""Name of a target -> the role of its classes; a new name is added here and nowhere else."""

WIRE = "wire"
"""Name of the target whose points are traced to conductors."""

LONGEST_NAME = 20
"""Bytes of the name of a target: a dimension of a LAS file has at most 32, and
``NAME_probability`` is one."""

_NAME = re.compile(r"[a-z][a-z0-9_]*")


@dataclass(frozen=True)
class Target:
    """What an observer finds.

    Attributes:
        name: of the target in results; it begins the names of the dimensions of points.
        own_codes: its class codes, ascending; None for a name of ``ROLES``, whose codes follow from
            the class scheme.
    """

    name: str
    own_codes: tuple[int, ...] | None = None

    @classmethod
    def parse(cls, text: str) -> Target:
        """The target that ``text`` names: ``wire``, ``14,16`` or ``lamp=14,16``.

        Codes without a name give the name ``class_14_16``.

        Raises:
            InputError: there is no such name, a code is not from 0 to 255, or the name cannot be
                that of a target.
        """
        name, named, listed = text.strip().partition("=")
        if not named and not name[:1].isdigit():
            if name not in ROLES:
                raise InputError(
                    f"there is no target {text!r}",
                    remedy=f"Choose {', '.join(ROLES)}, or give class codes, such as 14,16 or "
                    "lamp=14",
                )
            return cls(name)
        codes = _codes(listed if named else name, text)
        return cls(_checked(name if named else "_".join(["class", *map(str, codes)])), codes)

    @property
    def text(self) -> str:
        """The text that ``parse`` reads, the same for all that mean this target."""
        if self.own_codes is None:
            return self.name
        return f"{self.name}={_listed(self.own_codes)}"

    @property
    def is_tower(self) -> bool:
        """Whether it is the tower: only what finds towers leads to a list of towers."""
        return self == TOWER

    def codes_in(self, scheme: ClassScheme) -> frozenset[int]:
        """Its class codes in a scheme."""
        if self.own_codes is not None:
            return frozenset(self.own_codes)
        return scheme.with_role(ROLES[self.name])

    def among(self, classification: np.ndarray, scheme: ClassScheme) -> np.ndarray:
        """(N,) bool: which of the class codes (N,) in a scheme are its own."""
        return np.isin(classification, list(self.codes_in(scheme)))

    def described(self, scheme: ClassScheme) -> str:
        """Its name and codes for a message: "wire (class codes 16, 17 in edp)"."""
        codes = self.codes_in(scheme)
        noun = "class code" if len(codes) == 1 else "class codes"
        return f"{self.name} ({noun} {_listed(sorted(codes), ', ')} in {scheme.name})"

    def none_labelled(self, scheme: ClassScheme, counts: np.ndarray) -> str:
        """Why a file is not used, as a sentence: no point has its codes.

        Args:
            counts: (256,) points of each class code in the file.
        """
        found = _listed(np.flatnonzero(counts).tolist(), ", ") or "none"
        return f"no point is labelled {self.described(scheme)}; the codes in it are {found}"


TOWER = Target("tower")


def canonical(text: str) -> str:
    """``Target.text`` of the target that ``text`` names.

    Raises:
        InputError: as ``Target.parse``.
    """
    return Target.parse(text).text


def markdown() -> str:
    """The targets with their codes in each scheme as a Markdown table, for the documentation."""
    rows = []
    for name in ROLES:
        codes = (_listed(sorted(Target(name).codes_in(each)), ", ") for each in SCHEMES.values())
        rows.append(" | ".join([f"| `{name}`", *codes]) + " |")
    head = " | ".join(["| target", *(f"`{scheme}`" for scheme in SCHEMES)]) + " |"
    return "\n".join([head, "|" + "---|" * (len(SCHEMES) + 1), *rows])


def _codes(listed: str, text: str) -> tuple[int, ...]:
    parts = [part.strip() for part in listed.split(",")]
    if not all(part.isdecimal() and int(part) < 256 for part in parts):
        raise InputError(
            f"{text!r} is not a list of class codes from 0 to 255",
            remedy="Write them with commas, such as 14,16 or lamp=14",
        )
    return tuple(sorted(set(map(int, parts))))


def _checked(name: str) -> str:
    """The name of a target with codes of its own.

    Raises:
        InputError: it cannot be the name of a target.
    """
    if name == TOWER.name:
        raise InputError(
            "the codes of target tower follow from the class scheme",
            remedy="Choose another name for other codes",
        )
    if not _NAME.fullmatch(name):
        raise InputError(
            f"{name!r} cannot be the name of a target",
            remedy="Use lower-case letters, digits and underscores, and begin with a letter",
        )
    if len(name) > LONGEST_NAME:
        raise InputError(
            f"the name {name!r} of a target has {len(name)} bytes, and {name}_probability would "
            f"have more than the 32 of a LAS dimension",
            remedy=f"Give a name of at most {LONGEST_NAME} bytes, such as lamp=14,16",
        )
    return name


def _listed(codes: Iterable[int], between: str = ",") -> str:
    return between.join(map(str, codes))
