"""Synthetic corridor surveys with known truth (thesis 5.1), for users without a survey.

- ``settings``: the settings of a survey.
- ``scene``: terrain, vegetation, towers and the line.
- ``returns``: the points that the scanner gets from the scene.
- ``annotation_noise``: labels as annotators assign them.
- ``codes``: the class codes.
- ``corridor``: a whole corridor, stretch by stretch.
- ``survey``: the files of a survey; ``survey_tiles``: cut into tiles.
"""

from __future__ import annotations

from scenenet.synthetic.corridor import Corridor, Stretch, TrueTower, corridor_cloud, make_corridor
from scenenet.synthetic.settings import SyntheticSettings
from scenenet.synthetic.survey import is_synthetic_survey, make_survey, towers_geojson
from scenenet.synthetic.survey_tiles import tile_names

__all__ = [
    "Corridor",
    "Stretch",
    "SyntheticSettings",
    "TrueTower",
    "corridor_cloud",
    "is_synthetic_survey",
    "make_corridor",
    "make_survey",
    "tile_names",
    "towers_geojson",
]
