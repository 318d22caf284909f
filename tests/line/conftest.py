"""Lines whose conductors are known."""

from __future__ import annotations

import pytest
from fixtures.line_scene import PYLONS, KnownLine, known_line


@pytest.fixture(scope="session")
def pylons() -> KnownLine:
    """Six pylons with two circuits and an earth wire, and bends."""
    return known_line(**PYLONS)


@pytest.fixture(scope="session")
def poles() -> KnownLine:
    """Six poles with one circuit."""
    return known_line(step=0.9)
