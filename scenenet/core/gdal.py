"""How the library that reads and writes GeoPackages is loaded."""

from __future__ import annotations

import sys
from types import ModuleType

DATA_FRAMES = ("pandas", "pyarrow", "geopandas")
"""What pyogrio imports for its data frames wherever it is installed."""

_without_data_frames = False


def leave_out_data_frames() -> None:
    """Let pyogrio load in this process as where pandas, pyarrow and geopandas are missing.

    The package reads and writes arrays. In a short command the import of pandas takes longer than
    to write all layers. For a process in which no other code uses pyogrio: its data frames stay
    unusable there. Nothing changes where it is loaded already.
    """
    global _without_data_frames
    _without_data_frames = True


def load_pyogrio() -> ModuleType:
    """The module pyogrio, loaded where the first GeoPackage is read or written: it takes 40 MB,
    which the work before that would have beside it."""
    hidden = []
    if _without_data_frames and "pyogrio" not in sys.modules:
        hidden = [name for name in DATA_FRAMES if name not in sys.modules]
    # An entry None makes an import raise ImportError, as it does where nothing is installed.
    sys.modules.update(dict.fromkeys(hidden))  # type: ignore[arg-type]
    try:
        import pyogrio
        import pyogrio.raw
    finally:
        for name in hidden:
            del sys.modules[name]
    return pyogrio
