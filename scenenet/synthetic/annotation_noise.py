"""Annotation noise: annotators label the surroundings of a tower as tower (thesis 5.1.1).

"Among these roughly 50% are mislabeled patches of ground. The maintenance personnel normally labels
all 3D points near supporting towers". In the public TS40K crops they label an upright prism around
the tower, square and parallel to the line, 1.9 m to each side: everything in it except the ground
is tower, including grass and scrub at the foot, conductor ends and branches.
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
"""Half the side of the foot above which a tower is broad, and how far the prism of a broad tower
extends beyond its foot. The ground in it becomes tower too: pylons have as many wrong labels as
poles."""

TAKEN = (SCRUB, TREE, LOW, TALL)
GROUND_PATCH_M = 0.4
"""Points up to this height above the ground count as ground. At poles they become tower only at
strengths above 0.5."""


def annotate(
    xyz: np.ndarray,
    truth: np.ndarray,
    towers: Sequence[tuple[int, Support]],
    terrain: Raster,
    strength: float,
    seed: int,
    rng: np.random.Generator,
) -> np.ndarray:
    """The labels (N,) that an annotator assigns to points (N, 3) with true classes ``truth`` (N,).

    Args:
        towers: number and tower, for each tower near the points.
        terrain: elevation of the ground, m.
        strength: 0: the truth; 0.5: as in TS40K; 1: every tower in a wide prism with much ground.
        seed: seed of the survey, so that both sides of a tower are labelled alike although they are
            in different stretches.
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
        in_slab = (np.abs(along) < half_along) & (draw < coverage)
        inside = in_slab & (np.abs(across) < half_across)
        # Conductors are attached to the arms, which may be wider than the prism.
        taken = (inside & np.isin(classes, TAKEN)) | (in_slab & (classes == CONDUCTOR))
        if patch > 0:
            above = points[:, 2] - terrain.bilinear(points[:, 0], points[:, 1])
            low = inside & (above < GROUND_PATCH_M) & (classes != STRAY)
            taken |= low & (rng.random(len(near)) < patch)
        labels[near[taken]] = TOWER
    return labels
