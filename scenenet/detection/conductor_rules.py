"""The physics of conductors: every number that distinguishes a conductor from other objects,
with its unit and its reason.

A conductor hangs in free air. It is long, thin and nearly level, is attached to the head of a tower
and leads to the next support. What the numbers do is described in docs/method/detection.md.
"""

from __future__ import annotations

# Where conductors are looked for.

HEAD = 0.5
"""Share of the height above which conductors are looked for. Ground and shrubs are below; the
insulators of a window tower reach down to little more than half its height."""

MIN_ALONE, ALONE_M = 0.5, 1.5
"""Smallest share of points on conductors among the points within ``ALONE_M`` m of them."""

MAX_LEVELS, LEVEL_M = 4, 2.0
"""Largest number of conductors above one another, at least ``LEVEL_M`` m apart: three phases
and an earth wire. The storeys of a facade are more."""

NEAR, FAR = 3.0, 20.0
"""m from the axis between which conductors are searched: outside the body, and as far as the crop
of a tower reaches."""

RISE = 0.5
"""Steepest slope of a conductor; at the head of a tower on a slope it is about a third."""

RISE_OVER_GROUND = 0.15
"""Steepest slope of a conductor beyond that of the ground, where that is steep: half the sag of a
span, over a quarter of its length. Guys and jibs are steeper where the ground is level."""

SECTOR = 15.0
"""Largest difference in degrees between the bearings within a span: conductors diverge from the
head to the crossarms of the next tower."""

MIN_ANGLE = 45.0
"""Smallest angle in degrees between two spans; a line never turns back on itself."""

ATTACHED = 10.0
"""m from the axis up to which a conductor is straight enough to say where it is attached."""

CONTINUES_M = 3
"""m of a conductor that show where it is attached. Single places may be on a jumper."""

GAP = 3.0
"""m, largest gap along a conductor that a scanner may have missed."""

HIGHEST_M = 500.0
"""m above the ground; nothing higher is on a conductor, not even across a valley."""

LINE_M = 6.0
"""m, radius in which points are tested for a line; a conductor is straight over twice this."""

LINE_THICK_M = 0.3
"""m, radius of a line: a conductor or a bundle with the noise of its points."""

RING_M = 0.5, 0.8
"""m, radii of the free ring around a line; a bundle is narrower and the next conductor further."""

LINE_PIECES = 4
"""Smallest number of pieces of a metre with a point on a line of twice ``LINE_M``."""

LINE_BESIDE = 0.25
"""Largest number of points in the ring around a line per point on it. A surface has one, a crown
four."""

LINE_CELL_M = 0.25
"""m, cells of which one point counts: a line looks alike at every density of points."""

TESTED_CELL_M = 1.0
"""m, cells of which one point is tested: a conductor passes through one in every metre."""

MIN_LENGTH = 7.0
"""m, shortest span; rows of treetops are seldom longer."""

# A conductor is attached to the head of its tower.

OVER_M = 1.0
"""m above the top that the lowest conductor may pass. Over a tree it passes higher."""

UNDER_TOP = 0.7
"""Smallest height of the highest conductor as a share of the height of its tower. A tower is no
taller than its conductors need; a tree beside a line is."""

BESIDE_M, BESIDE = 1.5, 0.05
"""Largest distance of the axis from the nearest conductor if all pass on one side, as on a
flag-shaped head: m for a pole, and share of the height for a wider body. Trees beside a line are
further away."""

POLE_M = 1.2
"""m, largest width of a pole."""

WINDOW_M = 2.5
"""m, smallest width of the conductors amid which an axis is looked for; the crossarm of a pole is
hardly narrower. Amid narrower ones is a tree under the line."""

OPPOSITE = 120.0
"""degrees; two spans further apart than this are the two sides of one line."""

# A conductor bends where it is carried.

BEND = 0.015
"""Half the change of its slope, or of its direction, m per m, up to which a conductor passes
without a bend. On level ground it is the length of the spans over twice the catenary parameter: .05
to .1 in most lines, and .015 for spans of 60 m pulled as tight as 2000 m."""

BEND_WIRE_M = 0.5
"""m across and up within which points are on the same conductor; the next one is a metre away."""

SHORTEST_SPAN_M = 25.0
"""m along the line between two towers that are wider than a pole. A tree near a tower stands where
the conductors already bend."""

# A conductor leads to the next support or to the edge of the data.

FURTHEST_M = 60.0
"""m from the tower up to which a conductor is followed. Jibs of tower cranes are seldom longer."""

STEP_M = 2.0
"""m, length of the pieces in which it is followed."""

ABOVE_GROUND_M = 2.0
"""m above the ground; lower voxels are not on a conductor."""

MISSED_M = 10.0
"""m, largest stretch without a return. Far from the tower a conductor has fewer."""

SIDE_M = 2.0
"""m, half width and half height of the corridor around the expected place of the next piece."""

SUPPORT_M = 4.0
"""m, planar distance within which a support or the edge of the data ends a conductor."""

SUPPORT = 0.6
"""Smallest share of the levels from the ground to the conductor that a support has a voxel at."""

# How much of it a tower needs.

WIDEST_HEAD_M = 20.0
"""m, largest distance at which a conductor passes the axis of a tower of any height."""

WIDE = 1.8
"""Reach of crossarms amid the conductors, as a multiple of ``crossarm``: the head of a window tower
is nearly as wide as half its height."""
