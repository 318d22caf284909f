"""How annotators label: the surroundings of a tower become tower (thesis 5.1.1).

"Among these roughly 50% are mislabeled patches of ground. The maintenance personnel normally labels
all 3D points near supporting towers". What is near is a box around the foot, some metres wide and
up to a few metres high, the ends of the wires, and branches that touch the tower.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scenenet.synthetic.line import TOWER as TOWER_STREAM
from scenenet.synthetic.line import Support
from scenenet.synthetic.noise import Raster, stream
from scenenet.synthetic.scan import NOISE, TOWER, WIRE


def annotate(
    xyz: np.ndarray,
    truth: np.ndarray,
    towers: Sequence[tuple[int, Support]],
    terrain: Raster,
    strength: float,
    seed: int,
    rng: np.random.Generator,
) -> np.ndarray:
    """The labels (N,) an annotator gives to points (N, 3) with classes ``truth`` (N,).

    Args:
        towers: number and tower, for each that stands near the points.
        terrain: elevation of the ground, m.
        strength: 0 the truth, 1 every tower in a wide and full patch.
        seed: seed of the survey; an annotator treats both sides of a tower alike, in whichever
            stretch they lie.
        rng: random numbers of this stretch.
    """
    labels = truth.copy()
    if strength == 0:
        return labels
    for number, tower in towers:
        hand = stream(seed, TOWER_STREAM, number)
        side = max(1.9, tower.structure.half_base + 1.1) * hand.uniform(0.8, 1.2) * (0.5 + strength)
        ceiling = hand.uniform(0.4, 2.2) * (0.5 + strength)
        coverage = min(1.0, hand.uniform(0.35, 1.0) * 2 * strength)
        wire_end = hand.uniform(0.5, 2.5) * 2 * strength
        branches = 0.4 * strength
        reach = np.abs(tower.structure.attachments[:, 0]).max() + wire_end + side
        near = np.flatnonzero(
            (np.abs(xyz[:, 0] - tower.x) < reach) & (np.abs(xyz[:, 1] - tower.y) < reach)
        )
        points, classes = xyz[near], truth[near]
        dx, dy = points[:, 0] - tower.x, points[:, 1] - tower.y
        above = points[:, 2] - terrain.bilinear(points[:, 0], points[:, 1])
        draw = rng.random(len(near))
        solid = (classes != WIRE) & (classes != NOISE)
        box = (np.abs(dx) < side) & (np.abs(dy) < side)
        patch = solid & box & (above < ceiling) & (draw < coverage)
        along = dx * np.cos(tower.azimuth) + dy * np.sin(tower.azimuth)
        wire = (classes == WIRE) & (np.abs(along) < wire_end)
        body = tower.structure.half_base + 0.6
        branch = solid & (np.hypot(dx, dy) < body) & (above < tower.height) & (draw < branches)
        labels[near[patch | wire | branch]] = TOWER
    return labels
