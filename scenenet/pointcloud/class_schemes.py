"""What the class codes of a survey mean.

Three schemes are known: ``edp`` (thesis Table 5.1), ``asprs`` (LAS 1.4, Table 17) and ``ts40k``,
the six merged classes with which the TS40K dataset's own tools write its ``.pt`` samples. Code 15
is a transmission tower in the first two, but most other codes differ (16 is a wire in the one and
14 in the other), and in the third a tower is 4, which is vegetation in the others. So the user
names the scheme and it is never guessed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np

from scenenet.core.errors import InputError


@dataclass(frozen=True)
class ClassScheme:
    """Names of class codes, and the codes that the method needs to know.

    Attributes:
        name: the name used in the survey sheet and on the command line.
        classes: code -> name of the class.
        tower: codes of power-line supporting towers.
        wire: codes of conductors.
        ground: codes of bare ground and surfaces on it.
        vegetation: codes of vegetation.
        noise: codes of points that the producer marked as noise.
    """

    name: str
    classes: Mapping[int, str]
    tower: frozenset[int]
    wire: frozenset[int]
    ground: frozenset[int]
    vegetation: frozenset[int]
    noise: frozenset[int]

    def class_name(self, code: int) -> str:
        return self.classes.get(int(code), f"undefined ({int(code)})")

    def is_tower(self, classification: np.ndarray) -> np.ndarray:
        """Boolean mask (N,) of the points labelled tower."""
        return np.isin(classification, list(self.tower))


EDP = ClassScheme(
    name="edp",
    classes=MappingProxyType(
        {
            0: "Created",
            1: "Unclassified",
            2: "Ground",
            3: "Low vegetation",
            4: "Medium vegetation",
            5: "Natural obstacle",
            6: "Human structures",
            7: "Low point",
            8: "Model keypoints",
            9: "Water",
            10: "Rail",
            11: "Road surface",
            12: "Overlap points",
            13: "Medium reliability",
            14: "Low reliability",
            15: "Power line support tower",
            16: "Main power line",
            17: "Other power line",
            18: "Fiber optic cable",
            19: "Not rated object to be considered",
            20: "Not rated object to be ignored",
            21: "Incidents",
        }
    ),
    tower=frozenset({15}),
    wire=frozenset({16, 17}),
    ground=frozenset({2, 10, 11}),
    vegetation=frozenset({3, 4, 5}),
    noise=frozenset({7}),
)

ASPRS = ClassScheme(
    name="asprs",
    classes=MappingProxyType(
        {
            0: "Created, never classified",
            1: "Unclassified",
            2: "Ground",
            3: "Low vegetation",
            4: "Medium vegetation",
            5: "High vegetation",
            6: "Building",
            7: "Low point (noise)",
            8: "Model keypoint",
            9: "Water",
            10: "Rail",
            11: "Road surface",
            12: "Overlap points",
            13: "Wire - guard (shield)",
            14: "Wire - conductor (phase)",
            15: "Transmission tower",
            16: "Wire-structure connector (insulator)",
            17: "Bridge deck",
            18: "High noise",
            19: "Overhead structure",
            20: "Ignored ground",
            21: "Snow",
            22: "Temporal exclusion",
        }
    ),
    tower=frozenset({15}),
    wire=frozenset({13, 14}),
    ground=frozenset({2, 11}),
    vegetation=frozenset({3, 4, 5}),
    noise=frozenset({7, 18}),
)

TS40K = ClassScheme(
    name="ts40k",
    classes=MappingProxyType(
        {
            0: "Noise",
            1: "Ground",
            2: "Low vegetation",
            3: "Medium vegetation and obstacles",
            4: "Power line support tower",
            5: "Power lines",
        }
    ),
    tower=frozenset({4}),
    wire=frozenset({5}),
    ground=frozenset({1}),
    vegetation=frozenset({2, 3}),
    noise=frozenset({0}),
)

Codes = Literal["edp", "asprs", "ts40k"]
"""The names of ``SCHEMES``, as settings take them."""

SCHEMES: Mapping[str, ClassScheme] = MappingProxyType({"edp": EDP, "asprs": ASPRS, "ts40k": TS40K})


def class_scheme(name: str) -> ClassScheme:
    """The scheme called ``name``.

    Raises:
        InputError: there is no such scheme; the message lists those there are.
    """
    try:
        return SCHEMES[name]
    except KeyError:
        raise InputError(
            f"unknown class codes {name!r}",
            remedy=f"Name one of: {', '.join(SCHEMES)} (they differ: wires are 16, 14 or 5)",
        ) from None
