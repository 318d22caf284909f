"""Vegetation that touches conductors: points so close to one that they may be its own.

Noise, spacers and dampers are up to half a metre from the middle of a bundle, and so are leaves of
a crown that it hangs in. Leaves hang together with the crown around the conductor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from scenenet.clearance.kinds import BY_HEIGHT, HOUSE, PLANT, Surroundings, kind_table
from scenenet.line.records import Conductor
from scenenet.pointcloud.class_schemes import ClassScheme

OWN_M = 0.15
"""m beyond the tube of a conductor within which points may still be its own: the noise of single
returns, spacers and vibration dampers."""

WIRE_M, WIRE_RMSE = 0.15, 3.0
"""m from a wire of a conductor up to which a point is its own, at least, and in terms of the RMSE:
the noise of its points."""

TOUCH_M = 1.0
"""m from a point in which what it hangs together with shows: it reaches out of the tube of a bundle
on all sides."""

AIR, MAY_BE, OWN = 0, 1, 2
"""What a point is to conductors: beside them, so close that it may be of one, and of one."""


def on_wires(xyz: np.ndarray, conductors: Sequence[Conductor]) -> np.ndarray:
    """(n,) int8: what points (n, 3) m are to conductors, one of ``AIR``, ``MAY_BE`` and ``OWN``."""
    found = np.zeros(len(xyz), np.int8)
    if not conductors:
        return found
    # Most points are below all conductors.
    high = np.flatnonzero(xyz[:, 2] >= min(map(_lowest, conductors)))
    found[high] = _on_wires(xyz[high], conductors)
    return found


def _lowest(conductor: Conductor) -> float:
    """m, elevation that no point of a conductor is below."""
    curve = conductor.catenary
    return min(curve.start[2], curve.end[2]) - conductor.sag - conductor.tube - OWN_M


def _on_wires(xyz: np.ndarray, conductors: Sequence[Conductor]) -> np.ndarray:
    """What ``on_wires`` gives, of points of which most are as high as conductors."""
    found = np.zeros(len(xyz), np.int8)
    # Conductors of a span are nearly parallel, so that along the first one most points are beside
    # the box around another.
    frame = conductors[0].catenary
    s, t = frame.along(xyz)
    z = np.ascontiguousarray(xyz[:, 2])
    for conductor in conductors:
        curve, reach = conductor.catenary, conductor.tube + OWN_M
        around = 2 * (reach + abs(curve.blowout))
        ends = frame.along(np.array([curve.start, curve.end]))
        near = (z >= _lowest(conductor)) & (found < OWN)
        for value, end in zip((t, s), (ends[1], ends[0]), strict=True):
            near &= (value >= end.min() - around) & (value <= end.max() + around)
        rows = np.flatnonzero(near)
        along, beside = curve.along(xyz[rows])
        inside = (along >= -reach) & (along <= curve.length + reach)
        rows = rows[inside & (np.abs(beside) <= reach + abs(curve.blowout))]
        left, above = curve.residuals(xyz[rows])
        inside = np.hypot(left, above) <= reach
        rows, left, above = rows[inside], left[inside], above[inside]
        wires = np.array(conductor.offsets)
        apart = np.hypot(left[:, None] - wires[:, 0], above[:, None] - wires[:, 1])
        own = apart.min(axis=1) <= max(WIRE_M, WIRE_RMSE * conductor.rmse)
        found[rows] = np.maximum(found[rows], np.where(own, OWN, MAY_BE))
    return found


def with_touching(
    around: Surroundings, xyz: np.ndarray, codes: np.ndarray | None, scheme: ClassScheme | None
) -> Surroundings:
    """The surroundings of conductors with those points that may be of one, and hang together with
    vegetation, or with a building.

    Args:
        around: points that are of no conductor.
        xyz: (n, 3) m, points that may be of one.
        codes: (n,) uint8, their class codes; None where only the heights decide.
        scheme: of the codes.
    """
    from scipy.spatial import cKDTree

    if scheme is not None and codes is not None:
        known = kind_table(scheme)[codes]
        may_stand = np.isin(known, (PLANT, HOUSE, BY_HEIGHT))
        xyz, known = xyz[may_stand], known[may_stand]
    else:
        known = np.full(len(xyz), BY_HEIGHT, np.int8)
    if not len(xyz):
        return around
    # Most points are below them.
    rows = np.flatnonzero(around.xyz[:, 2] >= xyz[:, 2].min() - TOUCH_M)
    rows = rows[np.isin(around.kind[rows], (PLANT, HOUSE))]
    for axis in range(2):
        place, low, high = around.xyz[rows, axis], xyz[:, axis].min(), xyz[:, axis].max()
        rows = rows[(place >= low - TOUCH_M) & (place <= high + TOUCH_M)]
    tree = cKDTree(around.xyz[rows])
    touching = tree.query_ball_point(xyz, TOUCH_M, return_length=True) >= around.few
    if not touching.any():
        return around
    xyz, known = xyz[touching], known[touching]
    kind = np.where(known == BY_HEIGHT, around.kind[rows[tree.query(xyz)[1]]], known)
    return replace(
        around,
        xyz=np.concatenate((around.xyz, xyz)),
        kind=np.concatenate((around.kind, kind.astype(np.int8))),
        height=np.concatenate((around.height, xyz[:, 2] - around.ground.height(xyz[:, :2]))),
    )
