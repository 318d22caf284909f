"""How annotators label: the surroundings of a tower become tower (thesis 5.1.1).

"Among these roughly 50% are mislabeled patches of ground. The maintenance personnel normally labels
all 3D points near supporting towers". In the public TS40K crops that is an upright prism around the
tower, square and along the line, 1.9 m to each side: all in it that was not on the ground already
is tower, which takes grass and scrub at the foot, the ends of the wires and branches that reach in.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scenenet.synthetic.codes import CONDUCTOR, LOW, SCRUB, STRAY, TALL, TOWER, TREE
from scenenet.synthetic.scene.line import TOWER as TOWER_STREAM
from scenenet.synthetic.scene.line import Support
from scenenet.synthetic.scene.random_fields import Raster, stream

HALF_SIDE_M = 1.9
"""Half the side of the prism at strength 0.5."""

BROAD_M, BESIDE_FOOT_M = 0.8, 1.9
"""Half the side of the foot from which on a tower is broad. Its prism goes so far beyond the foot,
and the ground in it becomes tower as well: pylons have as many wrong labels as poles."""

TAKEN = (SCRUB, TREE, LOW, TALL)
GROUND_PATCH_M = 0.4
"""At poles the ground itself becomes tower only beyond strength 0.5; up to this height."""


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
        strength: 0 the truth, 0.5 as in TS40K, 1 every tower in a wide prism with much ground.
        seed: seed of the survey; an annotator treats both sides of a tower alike, in whichever
            stretch they lie.
        rng: random numbers of this stretch.
    """
    labels = truth.copy()
    if strength == 0:
        return labels
    for number, tower in towers:
        hand = stream(seed, TOWER_STREAM, number)
        broad = tower.structure.half_base > BROAD_M
        side = tower.structure.half_base + BESIDE_FOOT_M if broad else HALF_SIDE_M
        side *= np.sqrt(2 * strength)
        half_along, half_across = side * hand.uniform(0.9, 1.1, 2)
        shift = hand.uniform(-0.2, 0.2, 2)
        coverage = min(1.0, 2 * strength) * hand.uniform(0.92, 1.0)
        patch = max(min(1.0, 2 * strength) * broad, 2 * strength - 1) * hand.uniform(0.4, 0.9)
        reach = side + 1.0 + np.abs(tower.structure.attachments[:, 0]).max()
        near = np.flatnonzero(
            (np.abs(xyz[:, 0] - tower.x) < reach) & (np.abs(xyz[:, 1] - tower.y) < reach)
        )
        points, classes = xyz[near], truth[near]
        dx, dy = points[:, 0] - tower.x, points[:, 1] - tower.y
        cos, sin = np.cos(tower.azimuth), np.sin(tower.azimuth)
        along, across = dx * cos + dy * sin - shift[0], dy * cos - dx * sin - shift[1]
        draw = rng.random(len(near))
        beside = (np.abs(along) < half_along) & (draw < coverage)
        inside = beside & (np.abs(across) < half_across)
        # Wires hold on at the arms, which may be wider than the prism.
        taken = (inside & np.isin(classes, TAKEN)) | (beside & (classes == CONDUCTOR))
        if patch > 0:
            above = points[:, 2] - terrain.bilinear(points[:, 0], points[:, 1])
            low = inside & (above < GROUND_PATCH_M) & (classes != STRAY)
            taken |= low & (rng.random(len(near)) < patch)
        labels[near[taken]] = TOWER
    return labels
