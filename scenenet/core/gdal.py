"""How the library that reads and writes GeoPackages is loaded."""

from __future__ import annotations

import sys

DATA_FRAMES = ("pandas", "pyarrow", "geopandas")
"""What pyogrio imports for its data frames wherever it is installed."""


def load_without_data_frames() -> None:
    """Import pyogrio as where pandas, pyarrow and geopandas are not installed.

    The package reads and writes arrays. In a short command the import of pandas takes longer than
    to write all layers. For a process in which no other code uses pyogrio: its data frames stay
    unusable there. Nothing changes where it is loaded already.
    """
    if "pyogrio" in sys.modules:
        return
    hidden = [name for name in DATA_FRAMES if name not in sys.modules]
    # An entry None makes an import raise ImportError, as it does where nothing is installed.
    sys.modules.update(dict.fromkeys(hidden))  # type: ignore[arg-type]
    try:
        import pyogrio  # noqa: F401
    finally:
        for name in hidden:
            del sys.modules[name]
