"""What stands in a synthetic corridor: what a detector should find."""

from __future__ import annotations

from dataclasses import dataclass

from scenenet.line.catenary import Catenary


@dataclass(frozen=True)
class TrueTower:
    """A tower of the corridor: what a detector should report.

    Attributes:
        id: 1, 2, ... along the line.
        x, y: centre of the foot, m, in the survey's CRS.
        base: elevation of the ground at the foot, m.
        height: from the foot to the top, m.
        type: kind of tower, see ``scene.towers.KINDS``.
    """

    id: int
    x: float
    y: float
    base: float
    height: float
    type: str


@dataclass(frozen=True)
class TrueTree:
    """A tree of the corridor.

    Attributes:
        x, y: stem, m, in the survey's CRS.
        base: elevation of the ground at the stem, m.
        height: m.
        radius: of its crown, m.
    """

    x: float
    y: float
    base: float
    height: float
    radius: float


@dataclass(frozen=True)
class TrueConductor:
    """A conductor or an earth wire of one span.

    Attributes:
        from_tower, to_tower: ids of the towers at its ends; 0 for one outside the survey.
        place: number of its attachment at a tower: the conductors, then the earth wires.
        is_earth_wire: whether it is an earth wire.
        subconductors: wires of its bundle.
        catenary: between its attachments, m, in the survey's CRS; of a bundle, that of the middle
            of its subconductors.
    """

    from_tower: int
    to_tower: int
    place: int
    is_earth_wire: bool
    subconductors: int
    catenary: Catenary
