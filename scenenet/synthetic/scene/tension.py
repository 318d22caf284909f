"""Tension towers: conductors end at strings that lie along the line, and jumpers lead their current
around the tower.

Real lines have them at bends, and every few spans on straight stretches; other towers only carry.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scenenet.line.catenary import Catenary
from scenenet.synthetic.scene.towers import Structure

SHORTEST_STRING_M = 0.6
"""Length of the strings where the insulators of a tower that carries are shorter, m."""
DIP = 0.15
"""How far the end of a string is below its start, as a share of its length."""
STRING_RADIUS_M = 0.07
JUMPER_DEPTH = 0.4
"""How far a jumper hangs below its ends, as a share of the distance between them."""
ASIDE_M = 0.6
"""m, how far a jumper is led around a body that stands in its way."""


@dataclass(frozen=True)
class Strung:
    """A tension tower in its frame.

    Attributes:
        structure: the tower with its strings. Its attachments are those of the span behind.
        behind, ahead: (W, 3) m, where the wires of the span behind and of the span ahead are
            attached; earth wires have no strings.
    """

    structure: Structure
    behind: np.ndarray
    ahead: np.ndarray


def strung(structure: Structure, half_turn: float) -> Strung:
    """A tower of the same kind that ends its conductors.

    Args:
        structure: the tower as it only carries them.
        half_turn: half of the change of direction of the line at it, radians to the left.
    """
    rows = list(structure.insulators)
    insulators = structure.members[rows]
    anchors = insulators[:, :3]
    lengths = np.linalg.norm(insulators[:, 3:6] - anchors, axis=1)
    lengths = np.maximum(lengths, SHORTEST_STRING_M)[:, None]
    ends = []
    for back in (True, False):
        along = np.array([-np.sin(half_turn), -np.cos(half_turn) if back else np.cos(half_turn)])
        ends.append(anchors + lengths * np.array([*along, -DIP]))
    strings = [
        np.column_stack((anchors, end, np.full((len(anchors), 2), STRING_RADIUS_M))) for end in ends
    ]
    members = np.concatenate((np.delete(structure.members, rows, axis=0), *strings))
    earth = structure.attachments[len(anchors) :]
    behind, ahead = (np.concatenate((end, earth)) for end in ends)
    first = len(members) - len(strings) * len(anchors)
    own = tuple(range(first, first + len(anchors)))
    return Strung(replace(structure, members=members, attachments=behind, insulators=own),
                  behind, ahead)  # fmt: skip


def jumper(start: np.ndarray, end: np.ndarray, aside: bool) -> Catenary:
    """The jumper between the ends (3,) m of two strings.

    Args:
        aside: whether it is led around the body to the left.
    """
    length = float(np.hypot(*(end - start)[:2]))
    return Catenary.of(start, end, length / (8 * JUMPER_DEPTH), ASIDE_M if aside else 0.0)
