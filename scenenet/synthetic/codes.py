"""Class codes of a synthetic survey: ``edp`` codes, as the public TS40K crops use them.

The crops do not follow the class names of thesis Table 5.1 everywhere. There "Rail" is bare
ground, "Road surface" is low vegetation and other low objects, "Overlap points" is everything tall,
and "Not rated object to be considered" is bare ground too (docs: synthetic surveys).
"""

from __future__ import annotations

from scenenet.pointcloud.class_schemes import EDP

UNCLASSIFIED = EDP.code_of("Unclassified")
GROUND = EDP.code_of("Ground")
GRASS = EDP.code_of("Low vegetation")
SCRUB = EDP.code_of("Medium vegetation")
TREE = EDP.code_of("Natural obstacle")
STRAY = EDP.code_of("Low point")
WATER = EDP.code_of("Water")
BARE = EDP.code_of("Rail")
LOW = EDP.code_of("Road surface")
TALL = EDP.code_of("Overlap points")
TOWER = EDP.code_of("Power line support tower")
CONDUCTOR = EDP.code_of("Main power line")
BARE_TOO = EDP.code_of("Not rated object to be considered")

ON_GROUND = (GROUND, GRASS, BARE, BARE_TOO, WATER)
"""Codes of what lies on the ground."""

TALL_M = 2.0
"""Things that reach higher above the ground than this are coded as tall, m."""
