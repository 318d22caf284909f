"""The points that the scanner gets from a synthetic corridor.

- ``flight``: the flight of the helicopter and its scan lines.
- ``scan``: the scanner of a survey.
- ``sweep``: the loop over all pulses of some scan lines.
- ``crown_returns``, ``ground_returns``: what a pulse meets on its way down.
- ``records``, ``pulse``: records and constants of these loops.
- ``conductors``: conductors and cables.
- ``clutter``: objects that resemble a tower, houses and fences.
- ``stray_returns``: points in the air and below the ground.
"""
