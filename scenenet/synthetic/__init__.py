"""Procedural corridor surveys with known truth (thesis 5.1), for who has no survey at hand."""

from __future__ import annotations

from scenenet.synthetic.corridor import Corridor, Stretch, TrueTower, corridor_cloud, make_corridor
from scenenet.synthetic.settings import SyntheticSettings
from scenenet.synthetic.survey import make_survey, towers_geojson

__all__ = [
    "Corridor",
    "Stretch",
    "SyntheticSettings",
    "TrueTower",
    "corridor_cloud",
    "make_corridor",
    "make_survey",
    "towers_geojson",
]
