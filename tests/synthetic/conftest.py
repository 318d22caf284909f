"""Settings of small corridors."""

from __future__ import annotations

import pytest

from scenenet.synthetic import SyntheticSettings, corridor_cloud

SMALL = {
    "towers": 3,
    "span": 50.0,
    "span_spread": 3.0,
    "half_width": 12.0,
    "density": 12.0,
    "section": 0,
    "margin": 15.0,
}
BARE = {
    "tree_cover": 0.0,
    "bush_cover": 0.0,
    "hedges": 0.0,
    "low_vegetation": 0.0,
    "roads": 0.0,
    "rails": 0.0,
    "clutter": 0.0,
    "other_lines": 0.0,
    "high_strays": 0.0,
    "low_strays": 0.0,
    "ranging_noise": 0.0,
    "swath_overlap": 0.0,
}
"""Only ground, towers and conductors."""


@pytest.fixture(scope="session")
def small():
    """A function that makes settings of a short, thin corridor."""
    return lambda **changes: SyntheticSettings(**(SMALL | changes))


@pytest.fixture(scope="session")
def bare(small):
    """The same with only the line on the ground, and without noise."""
    return lambda **changes: small(**(BARE | changes))


@pytest.fixture(scope="session")
def default():
    """The default survey: settings, cloud as annotated, true classes, true towers."""
    settings = SyntheticSettings()
    return settings, *corridor_cloud(settings)
